"""Chains as the text of a URDF, joint for joint.

The URDF link after joint i is frame i turned (or slid) by the joint alone, so the rest of the DH
link, A_i at q = 0, becomes the fixed origin of the next joint. Every joint moves along its z. A
row that follows the joint of another row is another joint, which mimics that one.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from typing import NamedTuple
from xml.etree import ElementTree as ET

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain, DHLink, Row
from icub_leg_fk.kinematics.rotation import Array, roll_pitch_yaw
import numpy as np

_PLACEHOLDER = '50000'  # effort and velocity, which URDF demands and no table gives
_COLOURS = {
    'bone': '0.82 0.82 0.85 1',
    'joint': '0.25 0.27 0.32 1',
    'tip': '0.90 0.45 0.10 1',
}
_BONE_RADIUS = 0.012  # m
_JOINT_RADIUS = 0.022  # m
_TIP_RADIUS = 0.015  # m
_SOLE_THICKNESS = 0.02  # m
_NOWHERE = np.zeros(3)
_SAME_AXIS = 1e-9  # m, and each entry of the axis


class _Joint(NamedTuple):
    """A joint of the URDF: where it is in its parent link, and how it moves."""

    parent: str
    origin: Array  # (4, 4)
    link: DHLink
    mimicked: str  # name of the joint that it follows; empty if it is moved by itself


def urdf_text(robot: str, chains: Sequence[Chain]) -> str:
    """Return the URDF of a robot of some chains, at least one.

    Raises:
        LegFKError: the chains have different roots or share a name, or a URDF has no words for
            one of their joints.
    """
    model = _Model(robot, chains)
    for chain in chains:
        model.add(chain)
    return model.text()


class _Model:
    """The robot element, as it grows chain by chain."""

    def __init__(self, robot: str, chains: Sequence[Chain]) -> None:
        tables = ', '.join(f'{chain.name} {chain.version}' for chain in chains)
        self._robot = ET.Element('robot', name=robot)
        _comment(
            self._robot,
            f'Written by `leg_fk urdf` from the Denavit-Hartenberg tables of {tables}.',
        )
        _comment(
            self._robot,
            'Links have no inertia; effort and velocity limits are placeholders.',
        )
        for name, rgba in _COLOURS.items():
            material = ET.SubElement(self._robot, 'material', name=name)
            ET.SubElement(material, 'color', rgba=rgba)
        self._base = ET.SubElement(self._robot, 'link', name=_common_root(chains))
        self._joints: dict[str, _Joint] = {}

    def add(self, chain: Chain) -> None:
        """Add a chain; of the joints that it shares with another each is there once."""
        parent, origin = chain.root_frame, chain.T_root_0
        _draw_bone(self._base, origin)
        for name, row in _named_rows(chain):
            if row.link.is_fixed:
                origin = origin @ row.link.transform()
                continue
            mimicked = '' if row.is_first else row.joint
            joint = _Joint(parent, origin, row.link, mimicked)
            if name in self._joints:
                origin = self._shared_with(chain, name, joint) @ row.link.transform()
            else:
                self._add_joint(chain, name, joint)
                origin = row.link.transform()
            parent = _link_name(name)
        self._add_tip(chain, parent, origin @ chain.T_n_tip)

    def text(self) -> str:
        """Return the URDF."""
        names = Counter((element.tag, element.get('name')) for element in self._robot)
        for (kind, name), count in names.items():
            if kind in ('link', 'joint') and count > 1:
                raise LegFKError(
                    f'{kind} {name} is there {count} times; allowed: once, since a '
                    'URDF has each name once'
                )
        ET.indent(self._robot)
        return (
            f'<?xml version="1.0"?>\n{ET.tostring(self._robot, encoding="unicode")}\n'
        )

    def _shared_with(self, chain: Chain, name: str, joint: _Joint) -> Array:
        """Return where the joint that is there has this one; refuse one that is elsewhere.

        It may be elsewhere along and about its axis, which makes no difference to it.
        """
        there = self._joints[name]
        T = np.linalg.inv(there.origin) @ joint.origin
        off_axis = T[:3, 2] - (0.0, 0.0, 1.0)
        aside = np.zeros(2) if joint.link.is_prismatic else T[:2, 3]
        is_same = max(np.abs(off_axis).max(), np.abs(aside).max()) <= _SAME_AXIS
        if not is_same or _motion(joint) != _motion(there):
            raise LegFKError(
                f'joint {name!r} of chain {chain.name} is elsewhere in another '
                'chain; allowed: chains that agree on the joints they share'
            )
        return T

    def _add_joint(self, chain: Chain, name: str, joint: _Joint) -> None:
        self._joints[name] = joint
        driver = chain.joints[chain.joint_names.index(joint.mimicked or name)]
        _check_gain(chain, name, joint)
        lower, upper = _limits(joint, driver)
        is_limited = math.isfinite(lower) and math.isfinite(upper)
        if joint.link.is_prismatic and not is_limited:
            raise LegFKError(
                f'joint {name} of chain {chain.name} has no range; allowed: one with '
                'a range, since a URDF must limit a prismatic joint'
            )
        joint_type = joint.link.joint_type if is_limited else 'continuous'
        element = ET.SubElement(self._robot, 'joint', name=name, type=joint_type)
        _place(element, joint.origin, joint.parent, _link_name(name))
        sign = 1.0 if joint.mimicked else joint.link.gain
        ET.SubElement(element, 'axis', xyz=f'0 0 {sign:g}')
        if joint.link.erratum:
            _comment(element, f'Erratum of the printed table: {joint.link.erratum}')
        if joint.mimicked:
            multiplier = repr(joint.link.gain)
            ET.SubElement(element, 'mimic', joint=joint.mimicked, multiplier=multiplier)
        if is_limited:
            ET.SubElement(
                element,
                'limit',
                lower=repr(lower),
                upper=repr(upper),
                effort=_PLACEHOLDER,
                velocity=_PLACEHOLDER,
            )
        body = ET.SubElement(self._robot, 'link', name=_link_name(name))
        _draw(body, 'joint', 'sphere', radius=_JOINT_RADIUS)
        _draw_bone(body, joint.link.transform())

    def _add_tip(self, chain: Chain, parent: str, origin: Array) -> None:
        frames = chain.tip_frames.values()
        has_sole = any(frame.outline is not None for frame in frames)
        for frame in frames:
            name = f'{frame.frame_id}_joint'
            joint = ET.SubElement(self._robot, 'joint', name=name, type='fixed')
            _place(joint, origin @ frame.T_tip_frame, parent, frame.frame_id)
            tip = ET.SubElement(self._robot, 'link', name=frame.frame_id)
            if not has_sole:
                _draw(tip, 'tip', 'sphere', radius=_TIP_RADIUS)
            elif frame.outline is not None:
                _draw_sole(tip, frame.outline)


def _common_root(chains: Sequence[Chain]) -> str:
    roots = sorted({chain.root_frame for chain in chains})
    if len(roots) > 1:
        raise LegFKError(
            f'the chains have the roots {", ".join(roots)}; allowed: chains with the '
            'same root_frame, since a URDF has one root'
        )
    return roots[0]


def _named_rows(chain: Chain) -> Iterator[tuple[str, Row]]:
    """Give the standard rows of a chain with the names of their joints in the URDF.

    The first row of a joint has the joint's own name, each other that name and a number.
    """
    rows_of: Counter[str] = Counter()
    for row in replace(chain, convention='standard').rows():
        rows_of[row.joint] += 1
        name = row.joint if row.is_first else f'{row.joint}_{rows_of[row.joint]}'
        yield name, row


def _link_name(joint: str) -> str:
    return f'{joint}_link'


def _motion(joint: _Joint) -> tuple[str, str, float, str]:
    return joint.parent, joint.link.joint_type, joint.link.gain, joint.mimicked


def _check_gain(chain: Chain, name: str, joint: _Joint) -> None:
    """Refuse a joint whose row moves further than the joint does."""
    if not joint.mimicked and abs(joint.link.gain) != 1.0:
        raise LegFKError(
            f'joint {name} of chain {chain.name} moves its first row by '
            f'{joint.link.gain:g} times its position; allowed: 1 or -1 times, since '
            'a URDF has no gain'
        )


def _limits(joint: _Joint, driver: DHLink) -> tuple[float, float]:
    """Return the range of a joint's own motion [rad or m]."""
    lower, upper = driver.limits
    if not joint.mimicked:
        return lower, upper
    first, second = joint.link.gain * lower, joint.link.gain * upper
    return min(first, second), max(first, second)


def _place(joint: ET.Element, origin: Array, parent: str, child: str) -> None:
    _add_origin(joint, origin[:3, 3], roll_pitch_yaw(origin[:3, :3]))
    ET.SubElement(joint, 'parent', link=parent)
    ET.SubElement(joint, 'child', link=child)


def _add_origin(element: ET.Element, xyz: Array, rpy: Array) -> None:
    ET.SubElement(element, 'origin', xyz=_words(xyz), rpy=_words(rpy))


def _words(vector: Array) -> str:
    return ' '.join(map(repr, (vector + 0.0).tolist()))  # no negative zeros


def _draw(
    link: ET.Element,
    colour: str,
    shape: str,
    xyz: Array = _NOWHERE,
    rpy: Array = _NOWHERE,
    **size: float | str,
) -> None:
    visual = ET.SubElement(link, 'visual')
    _add_origin(visual, xyz, rpy)
    geometry = ET.SubElement(visual, 'geometry')
    ET.SubElement(geometry, shape, {name: str(value) for name, value in size.items()})
    ET.SubElement(visual, 'material', name=colour)


def _draw_bone(link: ET.Element, T: Array) -> None:
    """Draw a cylinder from the link's origin to that of a frame in it."""
    end = T[:3, 3]
    x, y, z = end.tolist()
    length = math.hypot(x, y, z)
    if length >= _JOINT_RADIUS:
        rpy = np.array([0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)])
        _draw(
            link, 'bone', 'cylinder', end / 2, rpy, radius=_BONE_RADIUS, length=length
        )


def _draw_sole(tip: ET.Element, outline: Array) -> None:
    """Draw a box that stands on the outline of the sole."""
    corners = np.pad(outline, ((0, 0), (0, 1)))
    low, high = corners.min(axis=0), corners.max(axis=0)
    high[2] += _SOLE_THICKNESS
    size = ' '.join(f'{length:g}' for length in high - low)
    _draw(tip, 'tip', 'box', (low + high) / 2, size=size)


def _comment(parent: ET.Element, text: str) -> None:
    parent.append(ET.Comment(f' {text.replace("--", "- -")} '))
