"""What a URDF says of a robot's kinematics: its links, its joints, and where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from pathlib import Path
from typing import NamedTuple, NoReturn
from xml.etree import ElementTree as ET

from icub_leg_fk.errors import closest, InputFileError
from icub_leg_fk.kinematics.rotation import Array, turns_about
import numpy as np

MOVING = {'revolute': 'revolute', 'continuous': 'revolute', 'prismatic': 'prismatic'}
"""Types of joints that a table can have, and what they are there."""

_LARGEST_FILE = 50_000_000  # bytes
_LARGEST = 1e9  # m or rad; what is larger leaves no room to compute with
_LISTED = 12  # names in an error


class JointElement(NamedTuple):
    """A joint as it stands in the file; only what is on a way is looked at more closely.

    Attributes:
        name: name of the joint.
        kind: its type.
        parent: name of the link before it.
        child: name of the link after it.
        texts: texts by element and attribute, such as `('origin', 'xyz')`.
    """

    name: str
    kind: str
    parent: str
    child: str
    texts: Mapping[tuple[str, str], str]


class UrdfJoint(NamedTuple):
    """A joint on the way from a root to a tip.

    Attributes:
        name: name of the joint.
        kind: its type: `revolute`, `continuous`, `prismatic` or `fixed`.
        origin: (4, 4) transform from the link after it to the link before it, at q = 0.
        axis: (3,) unit vector in the link after it; 0 for a fixed one.
        lower: smallest position [rad or m].
        upper: largest position [rad or m].
    """

    name: str
    kind: str
    origin: Array
    axis: Array
    lower: float
    upper: float

    @property
    def moves(self) -> bool:
        """Whether a table has a joint here."""
        return self.kind in MOVING

    def motion(self, q: Array) -> Array:
        """Return the (N, 4, 4) motion about or along its axis for (N,) positions [rad or m]."""
        T = np.tile(np.eye(4), (len(q), 1, 1))
        if self.kind == 'prismatic':
            T[:, :3, 3] = q[:, None] * self.axis
        else:
            T[:, :3, :3] = turns_about(self.axis, q)
        return T


@dataclass(frozen=True)
class Urdf:
    """The kinematics of a URDF.

    Attributes:
        file: its path.
        name: name of the robot.
        links: names of all links.
        joints: every joint, in the order of the file.
    """

    file: str
    name: str
    links: tuple[str, ...]
    joints: tuple[JointElement, ...]

    @classmethod
    def load(cls, path: str | Path) -> Urdf:
        """Read a URDF.

        Raises:
            InputFileError: it cannot be read or is not a URDF; says why.
        """
        file = str(path) if str(path).isprintable() else repr(str(path))
        robot = _robot_element(file, _read(file, path))
        links = [link.get('name', '') for link in robot.findall('link')]
        joints = [_joint_element(element) for element in robot.findall('joint')]
        return cls(file, robot.get('name', ''), tuple(dict.fromkeys(links)), tuple(joints))

    def tops(self) -> tuple[str, ...]:
        """Return the links that hang on nothing: one, if the URDF is a tree."""
        children = {joint.child for joint in self.joints}
        return tuple(link for link in self.links if link not in children)

    def ends(self) -> tuple[str, ...]:
        """Return the links that nothing hangs on."""
        parents = {joint.parent for joint in self.joints}
        return tuple(link for link in self.links if link not in parents)

    def path(self, root: str, tip: str) -> tuple[UrdfJoint, ...]:
        """Return the joints from a link down to another.

        Raises:
            InputFileError: there is no such link or no such way, or a joint on it cannot be
                described by a table.
        """
        for link in (root, tip):
            if link not in self.links:
                self._refuse_link(link)
        joints: list[UrdfJoint] = []
        passed = {tip}
        link = tip
        while link != root:
            above = self._joint_above(link)
            if above is None:
                self._fail(f'link {tip!r} is not below {root!r}; above it is {link!r}')
            joints.insert(0, self._checked(above))
            link = above.parent
            if link in passed:
                self._fail(f'link {link!r} is above itself; a URDF is a tree')
            passed.add(link)
        return tuple(joints)

    def forward(self, root: str, tip: str, positions: Mapping[str, Array]) -> Array:
        """Return T_root_tip, multiplied out joint by joint.

        Args:
            root: name of a link.
            tip: name of a link below it.
            positions: (N,) positions by joint [rad or m]; those of others are 0.

        Returns:
            (N, 4, 4) transforms.
        """
        n = len(next(iter(positions.values()), np.zeros(1)))
        T = np.broadcast_to(np.eye(4), (n, 4, 4))
        for joint in self.path(root, tip):
            T = T @ joint.origin
            if joint.moves and joint.name in positions:
                T = T @ joint.motion(positions[joint.name])
        return T

    def _joint_above(self, link: str) -> JointElement | None:
        above = [joint for joint in self.joints if joint.child == link]
        if len(above) > 1:
            names = ' and '.join(repr(joint.name) for joint in above[:2])
            self._fail(f'link {link!r} has two parents, joints {names}; a URDF is a tree')
        return above[0] if above else None

    def _checked(self, joint: JointElement) -> UrdfJoint:
        """Return a joint with its numbers read."""
        if joint.kind not in (*MOVING, 'fixed'):
            self._fail(f'joint {joint.name!r} is {joint.kind}; allowed: revolute, continuous, '
                       'prismatic, fixed')
        if joint.parent not in self.links:
            self._fail(f'joint {joint.name!r} names the link {joint.parent!r}, which is not there')
        if ('mimic', 'joint') in joint.texts:
            self._fail(f'joint {joint.name!r} mimics {joint.texts["mimic", "joint"]!r}; a table '
                       'has joints that move by themselves')
        origin = self._origin(joint)
        if joint.kind == 'fixed':
            return UrdfJoint(joint.name, joint.kind, origin, np.zeros(3), 0.0, 0.0)
        lower, upper = self._limits(joint)
        return UrdfJoint(joint.name, joint.kind, origin, self._axis(joint), lower, upper)

    def _origin(self, joint: JointElement) -> Array:
        x, y, z = np.eye(3)
        roll, pitch, yaw = self._numbers(joint, 'origin', 'rpy', '0 0 0')
        T = np.eye(4)
        T[:3, :3] = turns_about(z, yaw) @ turns_about(y, pitch) @ turns_about(x, roll)
        T[:3, 3] = self._numbers(joint, 'origin', 'xyz', '0 0 0')
        return T

    def _axis(self, joint: JointElement) -> Array:
        axis = np.array(self._numbers(joint, 'axis', 'xyz', '1 0 0'))
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            self._fail(f'joint {joint.name!r}: axis is 0 0 0; allowed: a direction')
        return axis / length

    def _limits(self, joint: JointElement) -> tuple[float, float]:
        if joint.kind not in ('revolute', 'prismatic'):
            return -math.inf, math.inf
        if ('limit', 'lower') not in joint.texts and ('limit', 'upper') not in joint.texts:
            return -math.inf, math.inf
        lower, = self._numbers(joint, 'limit', 'lower', '0')
        upper, = self._numbers(joint, 'limit', 'upper', '0')
        if lower > upper:
            self._fail(f'joint {joint.name!r}: limit lower {lower:g} is above upper {upper:g}')
        return lower, upper

    def _numbers(self, joint: JointElement, tag: str, key: str, default: str) -> list[float]:
        """Return the numbers of an attribute, as many as its default has."""
        if (tag, key) not in joint.texts:
            return [float(word) for word in default.split()]
        text = joint.texts[tag, key]
        count = len(default.split())
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        is_finite = all(math.isfinite(value) for value in values)
        if len(values) != count or not is_finite:
            self._fail(f'joint {joint.name!r}: {tag} {key} is {text[:60]!r}; allowed: {count} '
                       f'finite number{"s" * (count > 1)}')
        if tag != 'limit' and max(map(abs, values)) > _LARGEST:
            self._fail(f'joint {joint.name!r}: {tag} {key} is {text[:60]!r}; allowed: up to '
                       f'{_LARGEST:g}')
        return values

    def _refuse_link(self, link: str) -> NoReturn:
        guess = closest(link, self.links)
        if guess is None:
            holding = [name for name in self.links if link.casefold() in name.casefold()]
            guess = holding[0] if holding else None
        hint = f'did you mean {guess!r}? ' if guess else ''
        known = ', '.join(self.links[:_LISTED])
        more = ' and more' if len(self.links) > _LISTED else ''
        self._fail(f'unknown link {link!r}; {hint}known: {known}{more}')

    def _fail(self, fault: str) -> NoReturn:
        raise InputFileError(self.file, fault)


def _read(file: str, path: str | Path) -> bytes:
    try:
        with open(path, 'rb') as stream:
            data = stream.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:  # a ValueError for a zero byte in the path
        reason = getattr(error, 'strerror', None) or str(error)
        raise InputFileError(file, f'cannot be read: {reason.lower()}') from None
    if len(data) > _LARGEST_FILE:
        raise InputFileError(file, f'has more than {_LARGEST_FILE} bytes; a URDF is smaller')
    return data


def _robot_element(file: str, data: bytes) -> ET.Element:
    if b'<!DOCTYPE' in data or b'<!ENTITY' in data:
        raise InputFileError(file, 'declares a document type or entities, which a URDF has no use '
                                   'for')
    try:
        robot = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:
        raise InputFileError(file, f'is not XML: {error}') from None
    if any('xacro}' in str(element.tag) for element in robot.iter()):
        raise InputFileError(file, 'is a xacro file; this makes a URDF of it: xacro '
                                   f'{Path(file).name} > robot.urdf')
    if robot.tag != 'robot':
        raise InputFileError(file, f'is not a URDF: its root is <{robot.tag[:60]}>; allowed: '
                                   '<robot>')
    return robot


def _joint_element(element: ET.Element) -> JointElement:
    texts = {}
    for part in element:
        if element.find(part.tag) is part:  # of several the first counts
            for key, value in part.items():
                texts[part.tag, key] = value
    return JointElement(
        element.get('name', ''), element.get('type', ''), texts.get(('parent', 'link'), ''),
        texts.get(('child', 'link'), ''), texts)
