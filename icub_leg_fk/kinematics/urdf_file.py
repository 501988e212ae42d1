"""What a URDF says of a robot's kinematics: its links, its joints, and where they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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


class UrdfJoint(NamedTuple):
    """A joint of a URDF.

    Attributes:
        name: name of the joint.
        kind: its type, as the URDF has it.
        parent: name of the link before it.
        child: name of the link behind it.
        origin: (4, 4) transform from the child to the parent, at q = 0.
        axis: (3,) unit vector in the child.
        lower: smallest position [rad or m].
        upper: largest position [rad or m].
        mimics: the joint it follows; empty if none.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float
    upper: float
    mimics: str


@dataclass(frozen=True)
class Urdf:
    """The kinematics of a URDF.

    Attributes:
        file: its path.
        name: name of the robot.
        links: names of all links.
        joints: the joint that leads to each link, by the link's name.
    """

    file: str
    name: str
    links: tuple[str, ...]
    joints: Mapping[str, UrdfJoint]

    @classmethod
    def load(cls, path: str | Path) -> Urdf:
        """Read a URDF.

        Raises:
            InputFileError: it cannot be read or is not a URDF; says why.
        """
        return _read(path)

    def path(self, root: str, tip: str) -> tuple[UrdfJoint, ...]:
        """Return the joints from a link down to another.

        Raises:
            InputFileError: there is no such link or no such way, or a joint on it cannot be
                described by a table.
        """
        for link in (root, tip):
            if link not in self.links:
                guess = closest(link, self.links) or next(
                    (name for name in self.links if link.casefold() in name.casefold()), None)
                shown = ', '.join(self.links[:_LISTED])
                more = ' and more' if len(self.links) > _LISTED else ''
                raise InputFileError(f'{self.file}: unknown link {link!r}; '
                                     + (f'did you mean {guess!r}? ' if guess else '')
                                     + f'known: {shown}{more}')
        joints: list[UrdfJoint] = []
        link = tip
        while link != root:
            if link not in self.joints:
                raise InputFileError(f'{self.file}: link {tip!r} is not below {root!r}; above it '
                                     f'is {link!r}')
            joint = self.joints[link]
            if joint.kind not in (*MOVING, 'fixed'):
                raise InputFileError(f'{self.file}: joint {joint.name!r} is {joint.kind}; '
                                     f'allowed between {root!r} and {tip!r}: revolute, '
                                     'continuous, prismatic, fixed')
            if joint.mimics:
                raise InputFileError(f'{self.file}: joint {joint.name!r} mimics {joint.mimics!r}; '
                                     'a table has joints that move by themselves')
            joints.insert(0, joint)
            link = joint.parent
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
            if joint.kind in MOVING and joint.name in positions:
                T = T @ _motion(joint, positions[joint.name])
        return T


def _motion(joint: UrdfJoint, q: Array) -> Array:
    """Return the (N, 4, 4) motion of a joint: about its axis or along it."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    if joint.kind == 'prismatic':
        T[:, :3, 3] = q[:, None] * joint.axis
        return T
    T[:, :3, :3] = turns_about(joint.axis, q)
    return T


def _read(path: str | Path) -> Urdf:
    file = str(path) if str(path).isprintable() else repr(str(path))

    def fail(text: str) -> NoReturn:
        raise InputFileError(f'{file}: {text}') from None

    try:
        with open(path, 'rb') as stream:
            data = stream.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        fail(getattr(error, 'strerror', None) or str(error))
    if len(data) > _LARGEST_FILE:
        fail(f'has more than {_LARGEST_FILE} bytes; a URDF is smaller')
    if b'<!DOCTYPE' in data or b'<!ENTITY' in data:
        fail('declares a document type or entities, which a URDF has no use for')
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:
        fail(f'is not XML: {error}')
    if any(str(element.tag).startswith('{http') and 'xacro' in str(element.tag)
           for element in root.iter()):
        fail('is a xacro file; this makes a URDF of it: xacro '
             f'{Path(file).name} > robot.urdf')
    if root.tag != 'robot':
        fail(f'is not a URDF: its root is <{root.tag[:60]}>; allowed: <robot>')
    links = tuple(dict.fromkeys(link.get('name', '') for link in root.findall('link')))
    joints: dict[str, UrdfJoint] = {}
    for element in root.findall('joint'):
        joint = _joint(element, fail)
        for link in (joint.parent, joint.child):
            if link not in links:
                fail(f'joint {joint.name!r} names the link {link!r}, which is not there')
        if joint.child in joints:
            fail(f'link {joint.child!r} has two parents, joints {joints[joint.child].name!r} and '
                 f'{joint.name!r}; a URDF is a tree')
        joints[joint.child] = joint
    for link in links:
        seen = {link}
        while link in joints:
            link = joints[link].parent
            if link in seen:
                fail(f'link {link!r} is above itself; a URDF is a tree')
            seen.add(link)
    return Urdf(file, root.get('name', ''), links, joints)


def _joint(element: ET.Element, fail: Callable[[str], NoReturn]) -> UrdfJoint:
    name = element.get('name', '')

    def numbers(tag: str, key: str, default: str, count: int) -> list[float]:
        found = element.find(tag)
        text = default if found is None else found.get(key, default)
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            fail(f'joint {name!r}: {tag} {key} is {text[:60]!r}; allowed: {count} finite '
                 f'number{"s" * (count > 1)}')
        if tag in ('origin', 'axis') and max(map(abs, values)) > _LARGEST:
            fail(f'joint {name!r}: {tag} {key} is {text[:60]!r}; allowed: up to {_LARGEST:g}')
        return values

    def link(tag: str) -> str:
        found = element.find(tag)
        if found is None or not found.get('link'):
            fail(f'joint {name!r}: no {tag} link')
        return found.get('link', '')

    kind = element.get('type', '')
    origin = np.eye(4)
    x, y, z = np.eye(3)
    roll, pitch, yaw = numbers('origin', 'rpy', '0 0 0', 3)
    origin[:3, :3] = turns_about(z, yaw) @ turns_about(y, pitch) @ turns_about(x, roll)
    origin[:3, 3] = numbers('origin', 'xyz', '0 0 0', 3)
    axis = np.array(numbers('axis', 'xyz', '1 0 0', 3))
    length = float(np.linalg.norm(axis))
    if kind in MOVING and length < 1e-9:
        fail(f'joint {name!r}: axis is 0 0 0; allowed: a direction')
    lower, upper = -math.inf, math.inf
    if kind in ('revolute', 'prismatic') and element.find('limit') is not None:
        lower, = numbers('limit', 'lower', '0', 1)
        upper, = numbers('limit', 'upper', '0', 1)
        if lower > upper:
            fail(f'joint {name!r}: limit lower {lower:g} is above '
                 f'upper {upper:g}')
    mimic = element.find('mimic')
    return UrdfJoint(name, kind, link('parent'), link('child'), origin,
                     axis / length if length else axis, lower, upper,
                     '' if mimic is None else mimic.get('joint', '?'))
