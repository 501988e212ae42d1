"""What a URDF says of a robot's kinematics: its links, its joints, and where they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path
import re
import sys
from typing import NamedTuple, NoReturn

from icub_leg_fk.errors import closest, InputFileError, UnknownNameError
from icub_leg_fk.kinematics.input_bytes import first_bytes, shown
from icub_leg_fk.kinematics.rotation import Array, quaternion_to_matrix, turns_about
from icub_leg_fk.kinematics.urdf_xml import REPLACEMENT, robot_element, tag
from lxml import etree
import numpy as np

MOVING = {'revolute': 'revolute', 'continuous': 'revolute', 'prismatic': 'prismatic'}
"""Types of joints that a table can have, and what they are there."""

_LARGEST_FILE = 50_000_000  # bytes
_LARGEST = 1e9  # m or rad; what is larger leaves no room to compute with
_MOST_ENDS = 24  # names in an error
_VERSIONS = ('1.0', '1.1', '1.2')
_NUMBER = re.compile(r'[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?')


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

    def __repr__(self) -> str:
        return f'<JointElement {self.name[:40]}: {self.kind[:20]}>'


class UrdfJoint(NamedTuple):
    """A joint on the way from a root to a tip.

    It is at `gain` times the position of the joint that moves it, plus `offset`.

    Attributes:
        name: name of the joint.
        kind: `revolute` or `prismatic`, as in a table, or `fixed`.
        origin: (4, 4) transform from the link after it to the link before it, at position 0.
        axis: (3,) unit vector in the link after it; 0 for a fixed one.
        moved_by: the joint that moves it, which is another one if it mimics that.
        gain: 1 if it moves by itself.
        offset: its position where the joint that moves it is at 0 [rad or m].
        lower: smallest position of the joint that moves it [rad or m].
        upper: largest position of the joint that moves it [rad or m].
    """

    name: str
    kind: str
    origin: Array
    axis: Array
    moved_by: str = ''
    gain: float = 1.0
    offset: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf

    @property
    def moves(self) -> bool:
        """Whether a table has a joint here."""
        return bool(self.moved_by)

    def motion(self, position: Array) -> Array:
        """Return the (N, 4, 4) motions about or along the axis for (N,) positions [rad or m]."""
        T = np.tile(np.eye(4), (len(position), 1, 1))
        if self.kind == 'prismatic':
            T[:, :3, 3] = position[:, None] * self.axis
        else:
            T[:, :3, :3] = turns_about(self.axis, position)
        return T

    def __repr__(self) -> str:
        return f'<UrdfJoint {self.name[:40]}: {self.kind}>'


@dataclass(frozen=True, repr=False)
class Urdf:
    """The kinematics of a URDF.

    Attributes:
        file: its path, or what else it is called in an error.
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
        file = shown(path)
        data = first_bytes(path, _LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise InputFileError(
                file, f'has more than {_LARGEST_FILE} bytes; a URDF is smaller'
            )
        return cls.parse(data, file)

    @classmethod
    def parse(cls, data: bytes, file: str) -> Urdf:
        """Return what a URDF says.

        Args:
            data: the URDF, maybe as `ros2 topic echo` or `ros2 param get` prints it.
            file: what it is called in an error.

        Raises:
            InputFileError: it is not a URDF; says why.
        """
        robot = robot_element(data, file)
        version = robot.get('version', '1.0')
        if version not in _VERSIONS:
            raise InputFileError(
                file,
                f'is a URDF of version {version[:20]!r}; allowed: '
                f'{", ".join(_VERSIONS)}',
            )
        links, joints = [], []
        for element in robot:
            if tag(element) == 'link':
                links.append(element.get('name', ''))
            elif tag(element) == 'joint':
                joints.append(_joint_element(element))
        names = {'link': links, 'joint': [joint.name for joint in joints]}
        for kind, names_of_kind in names.items():
            for name, count in Counter(names_of_kind).items():
                if count > 1:
                    raise InputFileError(
                        file,
                        f'has two {kind}s of the name {name!r}; allowed: each {kind} once',
                    )
        return cls(file, robot.get('name', ''), tuple(links), tuple(joints))

    def root(self) -> str:
        """Return the link that poses are given in if no other is named.

        Raises:
            InputFileError: there is no link, or no `root_link` and several at the top.
        """
        if 'root_link' in self.links:
            return 'root_link'
        if not self.links:
            self._fail('has no links')
        children = {joint.child for joint in self.joints}
        tops = [link for link in self.links if link not in children]
        if len(tops) != 1:
            shown = ', '.join(tops[:_MOST_ENDS]) or 'none'
            self._fail(
                f'has {len(tops)} links at the top ({shown}); allowed: one, or a root link '
                'that is named'
            )
        return tops[0]

    def ends(self) -> tuple[str, ...]:
        """Return the links that nothing hangs on."""
        parents = {joint.parent for joint in self.joints}
        return tuple(link for link in self.links if link not in parents)

    def check_link(self, link: str) -> None:
        """Refuse a link that is not there.

        Raises:
            UnknownNameError: lists the links at the ends.
        """
        if link in self._links:
            return
        ends = self.ends()[:_MOST_ENDS]
        within = [name for name in self.links if link.casefold() in name.casefold()]
        guess = closest(link, self.links) or next(iter(within), '')
        advice = f'did you mean {guess!r}?' if guess and guess not in ends else ''
        raise UnknownNameError('link', link, ends, advice, of=self.file)

    def path(self, root: str, tip: str) -> tuple[UrdfJoint, ...]:
        """Return the joints from one link to another.

        The way goes down, after it has gone up over fixed joints where the tip is not below the
        root; those are the other way round then.

        Raises:
            UnknownNameError: there is no such link; lists those at the ends.
            InputFileError: there is no such way, or a joint on it cannot be described by a table.
        """
        self.check_link(root)
        self.check_link(tip)
        down = self._way_up(tip, {root})
        passed = [tip, *(joint.parent for joint in down)]
        up = [] if passed[-1] == root else self._way_up(root, {*passed})
        turn = up[-1].parent if up else root
        if turn not in passed:
            self._fail(
                f'link {tip!r} is not below {root!r}; above it is {passed[-1]!r}'
            )
        path = []
        for joint in map(self._checked, up):
            if joint.kind != 'fixed':
                self._fail(
                    f'link {tip!r} is not below {root!r}, and joint {joint.name!r} above '
                    f'{root!r} moves'
                )
            origin = np.asarray(np.linalg.inv(joint.origin))
            path.append(joint._replace(origin=origin))
        path += map(self._checked, reversed(down[: passed.index(turn)]))
        return tuple(path)

    def forward(self, root: str, tip: str, positions: Mapping[str, Array]) -> Array:
        """Return T_root_tip, multiplied out joint by joint.

        Args:
            root: name of a link.
            tip: name of another link.
            positions: (N,) positions by joint [rad or m]; those of others are 0.

        Returns:
            (N, 4, 4) transforms.
        """
        n = len(next(iter(positions.values()), np.zeros(1)))
        T = np.broadcast_to(np.eye(4), (n, 4, 4))
        for joint in self.path(root, tip):
            T = T @ joint.origin
            if joint.moves:
                master = positions.get(joint.moved_by, np.zeros(n))
                T = T @ joint.motion(joint.gain * np.asarray(master) + joint.offset)
        return T

    @cached_property
    def _links(self) -> frozenset[str]:
        return frozenset(self.links)

    @cached_property
    def _joints_by_name(self) -> dict[str, JointElement]:
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def _joints_above(self) -> dict[str, list[JointElement]]:
        """The joints that lead to each link: one, if the URDF is a tree."""
        above: dict[str, list[JointElement]] = {}
        for joint in self.joints:
            above.setdefault(joint.child, []).append(joint)
        return above

    def _way_up(self, link: str, ends: set[str]) -> list[JointElement]:
        """Return the joints above a link, up to one of some links or to the top."""
        way: list[JointElement] = []
        passed = {link}
        while link in self._joints_above and link not in ends:
            above = self._joints_above[link]
            if len(above) > 1:
                self._fail(
                    f'link {link!r} has two parents, joints {above[0].name!r} and '
                    f'{above[1].name!r}; a URDF is a tree'
                )
            way.append(above[0])
            link = above[0].parent
            if link in passed:
                self._fail(f'link {link!r} is above itself; a URDF is a tree')
            passed.add(link)
        return way

    def _checked(self, joint: JointElement) -> UrdfJoint:
        """Return a joint of the way with its numbers read, once."""
        if joint.name not in self._read_joints:
            self._read_joints[joint.name] = self._read(joint)
        return self._read_joints[joint.name]

    @cached_property
    def _read_joints(self) -> dict[str, UrdfJoint]:
        return {}

    def _read(self, joint: JointElement) -> UrdfJoint:
        if joint.kind not in (*MOVING, 'fixed'):
            self._fail(
                f'joint {joint.name!r} is {joint.kind or "of no type"}; allowed: revolute, '
                'continuous, prismatic, fixed'
            )
        for link in (joint.parent, joint.child):
            if link not in self._links:
                self._fail(
                    f'joint {joint.name!r} names the link {link!r}, which is not there'
                )
        if not joint.name:
            self._fail(
                f'the joint from {joint.parent!r} to {joint.child!r} has no name'
            )
        for name in (joint.name, joint.parent, joint.child):
            if REPLACEMENT in name:
                self._fail(f'the name {name!r} has a byte that is not UTF-8 text')
        origin = self._origin(joint)
        if joint.kind == 'fixed':
            return UrdfJoint(joint.name, joint.kind, origin, np.zeros(3))
        self._check_limit(joint)
        axis, kind = self._axis(joint), MOVING[joint.kind]
        master, gain, offset = self._master(joint)
        if gain == 0.0:  # it stays where it is
            still = UrdfJoint(joint.name, kind, origin, axis)
            T = origin @ still.motion(np.array([offset]))[0]
            return UrdfJoint(joint.name, 'fixed', T, np.zeros(3))
        lower, upper = self._limits(master)
        return UrdfJoint(
            joint.name, kind, origin, axis, master, gain, offset, lower, upper
        )

    def _origin(self, joint: JointElement) -> Array:
        T = np.eye(4)
        T[:3, 3] = self._numbers(joint, 'origin', 'xyz', '0 0 0')
        if ('origin', 'quat_xyzw') not in joint.texts:
            x, y, z = np.eye(3)
            roll, pitch, yaw = self._numbers(joint, 'origin', 'rpy', '0 0 0')
            T[:3, :3] = (
                turns_about(z, yaw) @ turns_about(y, pitch) @ turns_about(x, roll)
            )
            return T
        if ('origin', 'rpy') in joint.texts:
            self._fail(
                f'joint {joint.name!r}: origin has rpy and quat_xyzw; allowed: one of them'
            )
        quaternion = np.array(self._numbers(joint, 'origin', 'quat_xyzw', '0 0 0 1'))
        length = float(np.linalg.norm(quaternion))
        if length < 1e-9:
            self._fail(
                f'joint {joint.name!r}: origin quat_xyzw is 0 0 0 0; allowed: a rotation'
            )
        T[:3, :3] = quaternion_to_matrix(quaternion / length)
        return T

    def _axis(self, joint: JointElement) -> Array:
        axis = np.array(self._numbers(joint, 'axis', 'xyz', '1 0 0'))
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            self._fail(f'joint {joint.name!r}: axis is 0 0 0; allowed: a direction')
        return axis / length

    def _master(self, joint: JointElement) -> tuple[str, float, float]:
        """Return the joint that moves a joint, how far it does, and from where.

        That joint may be in JointState messages only, as robot_state_publisher has it.
        """
        gain, offset = 1.0, 0.0
        name = joint.name
        passed = [name]
        while name in self._joints_by_name:
            joint = self._joints_by_name[name]
            if ('mimic', 'joint') not in joint.texts:
                break
            (multiplier,) = self._numbers(joint, 'mimic', 'multiplier', '1')
            (own_offset,) = self._numbers(joint, 'mimic', 'offset', '0')
            offset += gain * own_offset
            gain *= multiplier
            name = joint.texts['mimic', 'joint']
            if not name:
                self._fail(f'joint {joint.name!r}: mimic has no joint')
            if name in passed:
                self._fail(f'joint {name!r} mimics itself, by {" and ".join(passed)}')
            passed.append(name)
        return name, gain, offset

    def _check_limit(self, joint: JointElement) -> None:
        """Refuse a limit that urdfdom, and so robot_state_publisher, refuses."""
        elements = {element for element, _ in joint.texts}
        if joint.kind == 'continuous' and 'limit' not in elements:
            return
        for key in ('effort', 'velocity'):
            if ('limit', key) not in joint.texts:
                self._fail(
                    f'joint {joint.name!r} has no limit with {key}, which URDF wants of a '
                    f'{joint.kind} joint; its bounds may be left out'
                )
            self._numbers(joint, 'limit', key, '0')

    def _limits(self, name: str) -> tuple[float, float]:
        joint = self._joints_by_name.get(name)
        if joint is None or joint.kind not in ('revolute', 'prismatic'):
            return -math.inf, math.inf
        if not {('limit', 'lower'), ('limit', 'upper')} & {*joint.texts}:
            return -math.inf, math.inf
        (lower,) = self._numbers(joint, 'limit', 'lower', '0')
        (upper,) = self._numbers(joint, 'limit', 'upper', '0')
        if lower > upper:
            self._fail(
                f'joint {joint.name!r}: limit lower {lower:g} is above upper {upper:g}'
            )
        return lower, upper

    def _numbers(
        self, joint: JointElement, element: str, key: str, default: str
    ) -> list[float]:
        """Return the numbers of an attribute, as many as its default has."""
        text = joint.texts.get((element, key), default)
        words = text.split()
        count = len(default.split())
        are_numbers = all(_NUMBER.fullmatch(word) for word in words)
        if len(words) != count or not are_numbers:
            self._fail(
                f'joint {joint.name!r}: {element} {key} is {text[:60]!r}; allowed: {count} '
                f'finite number{"s" * (count > 1)}'
            )
        values = [float(word) for word in words]
        largest = sys.float_info.max if element == 'limit' else _LARGEST
        if not all(abs(value) <= largest for value in values):
            self._fail(
                f'joint {joint.name!r}: {element} {key} is {text[:60]!r}; allowed: up to '
                f'{largest:g}'
            )
        return values

    def _fail(self, fault: str) -> NoReturn:
        raise InputFileError(self.file, fault)

    def __repr__(self) -> str:
        return f'<Urdf {self.name[:40]}: {len(self.links)} links, {len(self.joints)} joints>'


def _joint_element(element: etree._Element) -> JointElement:
    texts: dict[tuple[str, str], str] = {}
    seen: set[str] = set()
    for part in element:
        name = tag(part)
        if name not in seen:  # of several the first counts
            seen.add(name)
            for key, value in part.items():
                texts[name, key] = value
    if 'mimic' in seen:  # even one without attributes
        texts.setdefault(('mimic', 'joint'), '')
    return JointElement(
        element.get('name', ''),
        element.get('type', ''),
        texts.get(('parent', 'link'), ''),
        texts.get(('child', 'link'), ''),
        texts,
    )
