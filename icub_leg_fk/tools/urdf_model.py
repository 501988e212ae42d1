"""Chains of a catalog as one URDF, joint for joint.

The URDF link after joint i is frame i turned (or slid) by the joint alone, so the rest of the DH
link, A_i at q = 0, becomes the fixed origin of the next joint. Every joint moves along its z.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
import math
from typing import NamedTuple
from xml.etree import ElementTree as ET

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.catalog import ChainEntry, ChainVersion
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.ros.configuration import SOLE_OUTLINE
import numpy as np

# URDF demands both, the tables give neither: values that hinder nobody.
EFFORT = VELOCITY = '50000'

COLOURS = {'bone': '0.82 0.82 0.85 1', 'joint': '0.25 0.27 0.32 1', 'tip': '0.90 0.45 0.10 1'}
BONE_RADIUS, JOINT_RADIUS, TIP_RADIUS = 0.012, 0.022, 0.015  # m
SOLE_THICKNESS = 0.02  # m


class Selection(NamedTuple):
    """A chain to write, in one version."""

    entry: ChainEntry
    version: str

    @property
    def table(self) -> ChainVersion:
        """Return the version's table."""
        return self.entry.versions[self.version]


def urdf_text(robot: str, selections: Sequence[Selection]) -> str:
    """Return the URDF of some chains that share their root.

    Args:
        robot: name of the robot.
        selections: the chains, at least one.

    Raises:
        LegFKError: the chains have different roots or share a name, or a prismatic joint has no
            range, which a URDF must state.
    """
    root_frames = {selection.table.root_frame for selection in selections}
    if len(root_frames) > 1:
        raise LegFKError(f'a URDF has one root: found {", ".join(sorted(root_frames))}; choose '
                         'chains with the same root_frame')
    root = ET.Element('robot', name=robot)
    chains = ', '.join(f'{entry.name} {version}' for entry, version in selections)
    _comment(root, f'Written by `leg_fk urdf` from the Denavit-Hartenberg tables of {chains}.')
    _comment(root, 'Links have no inertia; effort and velocity limits are placeholders.')
    for name, rgba in COLOURS.items():
        ET.SubElement(ET.SubElement(root, 'material', name=name), 'color', rgba=rgba)
    base = ET.SubElement(root, 'link', name=root_frames.pop())
    tree = _Tree(root)
    for selection in selections:
        _bone(base, selection.table.T_root_0[:3, 3])
        tree.add(selection)
    for kind in ('link', 'joint'):
        _refuse_shared_names(root, kind)
    ET.indent(root)
    return f'<?xml version="1.0"?>\n{ET.tostring(root, encoding="unicode")}\n'


def xyz_rpy(T: Array) -> tuple[Array, Array]:
    """Return a transform as URDF has it: translation, and roll, pitch, yaw [rad].

    R = Rz(yaw) Ry(pitch) Rx(roll). The yaw is taken out before the other two angles are read off,
    so they are as accurate at pitch = pi/2, where any yaw would do, as elsewhere.
    """
    R = T[:3, :3]
    yaw = 0.0 if math.hypot(R[0, 0], R[1, 0]) < 1e-15 else math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    pitch = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return T[:3, 3], np.array([roll, pitch, yaw])


class _Tree:
    """The links and joints of a URDF; a joint of several chains is there once."""

    def __init__(self, root: ET.Element) -> None:
        self._root = root
        self._joints: dict[str, tuple[str, DHLink, Array]] = {}

    def add(self, selection: Selection) -> None:
        """Add a chain.

        Raises:
            LegFKError: it has a joint that is elsewhere in another chain.
        """
        entry, table = selection.entry, selection.table
        origin, parent = table.T_root_0, table.root_frame
        names = iter(table.joint_names)
        for link in table.links:
            if link.is_fixed:
                origin = origin @ link.transform()
                continue
            name = next(names)
            if name in self._joints:
                origin = self._shared(entry.name, name, link, origin, parent) @ link.transform()
            else:
                self._joints[name] = parent, link, origin
                self._root.append(_joint(entry.name, name, link, origin, parent))
                element = ET.SubElement(self._root, 'link', name=f'{name}_link')
                _ball(element, 'joint', JOINT_RADIUS)
                origin = link.transform()
                _bone(element, origin[:3, 3])
            parent = f'{name}_link'
        for name, frame in table.tip_frames.items():
            self._root.append(_fixed(f'{frame.frame}_joint',
                                     origin @ table.T_n_tip @ frame.T_dh_tip, parent, frame.frame))
            tip = ET.SubElement(self._root, 'link', name=frame.frame)
            if name == 'sole':
                _sole(tip)
            elif 'sole' not in table.tip_frames:
                _ball(tip, 'tip', TIP_RADIUS)

    def _shared(self, chain: str, name: str, link: DHLink, origin: Array, parent: str) -> Array:
        """Return where a chain's frame is in the link of a joint that is there already.

        It may be elsewhere along and about the joint's axis, which makes no difference to it.
        """
        before, other, place = self._joints[name]
        T = np.linalg.inv(place) @ origin
        same = (before == parent and np.allclose(T[:3, 2], (0, 0, 1), rtol=0, atol=1e-9)
                and (link.is_prismatic or np.allclose(T[:2, 3], 0, rtol=0, atol=1e-9))
                and (link.joint_type, link.sign) == (other.joint_type, other.sign))
        if not same:
            raise LegFKError(f'joint {name!r} of chain {chain} is elsewhere in another chain; '
                             'choose chains that agree on the joints they share')
        return np.asarray(T)


def _joint(chain: str, name: str, link: DHLink, origin: Array, parent: str) -> ET.Element:
    documented = math.isfinite(link.limits[0])
    if link.is_prismatic and not documented:
        raise LegFKError(f'chain {chain}, joint {name}: found no range, allowed: one, since a '
                         'URDF must limit a prismatic joint')
    kind = link.joint_type if documented else 'continuous'
    joint = ET.Element('joint', name=name, type=kind)
    _place(joint, origin, parent, f'{name}_link')
    ET.SubElement(joint, 'axis', xyz=f'0 0 {link.sign}')
    if link.erratum:
        _comment(joint, f'Erratum of the printed table: {link.erratum}')
    if documented:
        ET.SubElement(joint, 'limit', lower=repr(link.limits[0]), upper=repr(link.limits[1]),
                      effort=EFFORT, velocity=VELOCITY)
    return joint


def _fixed(name: str, origin: Array, parent: str, child: str) -> ET.Element:
    joint = ET.Element('joint', name=name, type='fixed')
    _place(joint, origin, parent, child)
    return joint


def _place(joint: ET.Element, origin: Array, parent: str, child: str) -> None:
    _origin(joint, *xyz_rpy(origin))
    ET.SubElement(joint, 'parent', link=parent)
    ET.SubElement(joint, 'child', link=child)


def _origin(element: ET.Element, xyz: Array, rpy: Array) -> None:
    words = (' '.join(repr(value) for value in (vector + 0.0).tolist()) for vector in (xyz, rpy))
    ET.SubElement(element, 'origin', dict(zip(('xyz', 'rpy'), words, strict=True)))


def _visual(link: ET.Element, colour: str, xyz: Array, rpy: Array | None = None) -> ET.Element:
    visual = ET.SubElement(link, 'visual')
    _origin(visual, xyz, np.zeros(3) if rpy is None else rpy)
    geometry = ET.SubElement(visual, 'geometry')
    ET.SubElement(visual, 'material', name=colour)
    return geometry


def _ball(link: ET.Element, colour: str, radius: float) -> None:
    ET.SubElement(_visual(link, colour, np.zeros(3)), 'sphere', radius=repr(radius))


def _sole(link: ET.Element) -> None:
    corners = np.array(SOLE_OUTLINE)
    centre = (corners.min(axis=0) + corners.max(axis=0) + (0.0, 0.0, SOLE_THICKNESS)) / 2
    x, y, _ = np.ptp(corners, axis=0).tolist()
    ET.SubElement(_visual(link, 'tip', centre), 'box', size=f'{x:g} {y:g} {SOLE_THICKNESS:g}')


def _bone(link: ET.Element, end: Array) -> None:
    """Draw a cylinder from the link's origin to a point of it."""
    length = math.hypot(*end)
    if length < JOINT_RADIUS:
        return
    x, y, z = end.tolist()
    rpy = np.array([0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)])
    ET.SubElement(_visual(link, 'bone', end / 2, rpy), 'cylinder', radius=repr(BONE_RADIUS),
                  length=repr(length))


def _comment(parent: ET.Element, text: str) -> None:
    parent.append(ET.Comment(f' {text.replace("--", "- -")} '))


def _refuse_shared_names(root: ET.Element, kind: str) -> None:
    names = sorted(element.get('name', '') for element in root.findall(kind))
    for name, following in pairwise(names):
        if name == following:
            raise LegFKError(f'a URDF has each name once: found {kind} {name} twice; choose '
                             'chains without it')
