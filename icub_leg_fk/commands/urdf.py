"""`leg_fk urdf`: chains as a URDF, joint for joint.

The URDF link after joint i is frame i turned (or slid) by the joint alone, so the rest of the DH
link, A_i at q = 0, becomes the fixed origin of the next joint. Every joint moves along its z.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
import math
from pathlib import Path
from xml.etree import ElementTree as ET

from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, Chain, DHLink
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import options
from icub_leg_fk.tools.output_file import write_text
import numpy as np

EXAMPLES = """\
The URDF has the frames of the tables, both tip frames where a chain has two, the joint names, and
as limits the ranges: the robots' where they are known, else the printed ones. Every chain hangs
from the root frame, which the chains must share.

examples:
  leg_fk urdf -o legs.urdf
  leg_fk urdf left_leg --version v1
  leg_fk urdf left_leg right_leg head_imu=v2 -o icub.urdf
  leg_fk urdf -k my_robot.yaml --version v1 --name my_robot"""

_PLACEHOLDER = '50000'  # effort and velocity, which URDF demands and no table gives
_COLOURS = {'bone': '0.82 0.82 0.85 1', 'joint': '0.25 0.27 0.32 1', 'tip': '0.90 0.45 0.10 1'}
_BONE_RADIUS, _JOINT_RADIUS, _TIP_RADIUS, _SOLE_THICKNESS = 0.012, 0.022, 0.015, 0.02  # m
_NOWHERE = np.zeros(3)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('chains', metavar='CHAIN', nargs='*',
                        help='chains to write, such as left_leg or head_imu=v2 (default: all that have the '
                        'version asked for)')
    parser.add_argument('--name', help='name of the robot (default: icub, or that of your file)')
    options.add(parser, '--version', '--kinematics-file')
    options.add_output(parser, 'file to write (default: standard output)')


def run(args: argparse.Namespace) -> int:
    """Write the URDF."""
    catalog = options.load_catalog(args)
    robot = args.name or ('icub' if args.kinematics_file is None else Path(catalog.file).stem)
    if not robot.isprintable():
        raise LegFKError(f'--name: found {robot!r}, allowed: printable text')
    write_text(args.output, urdf_text(robot, _chosen_chains(catalog, args)), force=args.force)
    return 0


def _chosen_chains(catalog: Catalog, args: argparse.Namespace) -> tuple[Chain, ...]:
    """Return the chains asked for, or all that have the version asked for."""
    if args.chains:
        return catalog.select(args.chains, args.version)
    names = [name for name, entry in catalog.chains.items()
             if args.version is None or args.version in entry.versions]
    if not names:
        known = dict.fromkeys(version for entry in catalog.chains.values()
                              for version in entry.versions)
        raise UnknownNameError('version', args.version, known)
    return catalog.select(names, args.version)


def urdf_text(robot: str, chains: Sequence[Chain]) -> str:
    """Return the URDF of a robot of some chains, at least one.

    Raises:
        LegFKError: the chains have different roots or share a name, or a joint has no range.
    """
    roots = sorted({chain.root_frame for chain in chains})
    if len(roots) > 1:
        raise LegFKError(f'a URDF has one root: found {", ".join(roots)}; choose chains with the '
                         'same root_frame')
    model = ET.Element('robot', name=robot)
    _comment(model, 'Written by `leg_fk urdf` from the Denavit-Hartenberg tables of '
             f'{", ".join(f"{chain.name} {chain.version}" for chain in chains)}.')
    _comment(model, 'Links have no inertia; effort and velocity limits are placeholders.')
    for name, rgba in _COLOURS.items():
        ET.SubElement(ET.SubElement(model, 'material', name=name), 'color', rgba=rgba)
    base = ET.SubElement(model, 'link', name=roots[0])
    joints: dict[str, tuple[str, DHLink, Array]] = {}
    for chain in chains:
        _draw_bone(base, chain.T_root_0[:3, 3])
        _add_chain(model, joints, chain)
    for (kind, twice), count in Counter(
            (element.tag, element.get('name')) for element in model).items():
        if count > 1 and kind in ('link', 'joint'):
            raise LegFKError(f'a URDF has each name once: found {kind} {twice} twice; choose '
                             'chains without it')
    ET.indent(model)
    return f'<?xml version="1.0"?>\n{ET.tostring(model, encoding="unicode")}\n'


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


def _add_chain(model: ET.Element, joints: dict[str, tuple[str, DHLink, Array]], chain: Chain
               ) -> None:
    """Add a chain; `joints` are those that are there, with parent and origin: each is there once.

    A joint that is elsewhere in another chain is refused.
    """
    origin, parent = chain.T_root_0, chain.root_frame
    names = iter(chain.joint_names)
    for link in chain.links:
        if link.is_fixed:
            origin = origin @ link.transform()
            continue
        name = next(names)
        if name in joints:
            other_parent, other, place = joints[name]
            # It may be elsewhere along and about its axis, which makes no difference to it.
            T = np.linalg.inv(place) @ origin
            off_axis = np.hstack((T[:3, 2] - (0, 0, 1), T[:2, 3] * (not link.is_prismatic)))
            if np.abs(off_axis).max() > 1e-9 or (parent, link.joint_type, link.gain) != (
                    other_parent, other.joint_type, other.gain):
                raise LegFKError(f'joint {name!r} of chain {chain.name} is elsewhere in another chain; '
                                 'choose chains that agree on the joints they share')
            origin = T @ link.transform()
        else:
            joints[name] = parent, link, origin
            _add_joint(model, chain.name, name, link, origin, parent)
            origin = link.transform()
            body = ET.SubElement(model, 'link', name=f'{name}_link')
            _draw(body, 'joint', 'sphere', radius=_JOINT_RADIUS)
            _draw_bone(body, origin[:3, 3])
        parent = f'{name}_link'
    has_sole = any(frame.outline is not None for frame in chain.tip_frames.values())
    for frame in chain.tip_frames.values():
        _place(ET.SubElement(model, 'joint', name=f'{frame.frame_id}_joint', type='fixed'),
               origin @ chain.T_n_tip @ frame.T_tip_frame, parent, frame.frame_id)
        tip = ET.SubElement(model, 'link', name=frame.frame_id)
        if frame.outline is not None:
            corners = np.pad(frame.outline, ((0, 0), (0, 1)))
            low, high = corners.min(axis=0), corners.max(axis=0) + (0.0, 0.0, _SOLE_THICKNESS)
            _draw(tip, 'tip', 'box', (low + high) / 2, size='{:g} {:g} {:g}'.format(*high - low))
        elif not has_sole:
            _draw(tip, 'tip', 'sphere', radius=_TIP_RADIUS)


def _add_joint(model: ET.Element, chain: str, name: str, link: DHLink, origin: Array, parent: str
               ) -> None:
    lower, upper = link.limits
    if link.is_prismatic and not math.isfinite(lower):
        raise LegFKError(f'chain {chain}, joint {name}: found no range, allowed: one, since a '
                         'URDF must limit a prismatic joint')
    joint = ET.SubElement(model, 'joint', name=name,
                          type=link.joint_type if math.isfinite(lower) else 'continuous')
    _place(joint, origin, parent, f'{name}_link')
    ET.SubElement(joint, 'axis', xyz=f'0 0 {link.gain:g}')
    if link.erratum:
        _comment(joint, f'Erratum of the printed table: {link.erratum}')
    if math.isfinite(lower):
        ET.SubElement(joint, 'limit', lower=repr(lower), upper=repr(upper), effort=_PLACEHOLDER,
                      velocity=_PLACEHOLDER)


def _place(joint: ET.Element, origin: Array, parent: str, child: str) -> None:
    _add_origin(joint, *xyz_rpy(origin))
    ET.SubElement(joint, 'parent', link=parent)
    ET.SubElement(joint, 'child', link=child)


def _add_origin(element: ET.Element, xyz: Array, rpy: Array) -> None:
    xyz_words, rpy_words = (' '.join(map(repr, (vector + 0.0).tolist())) for vector in (xyz, rpy))
    ET.SubElement(element, 'origin', xyz=xyz_words, rpy=rpy_words)


def _draw(link: ET.Element, colour: str, shape: str, xyz: Array = _NOWHERE, rpy: Array = _NOWHERE,
          **size: float | str) -> None:
    visual = ET.SubElement(link, 'visual')
    _add_origin(visual, xyz, rpy)
    ET.SubElement(ET.SubElement(visual, 'geometry'), shape,
                  {name: str(value) for name, value in size.items()})
    ET.SubElement(visual, 'material', name=colour)


def _draw_bone(link: ET.Element, end: Array) -> None:
    """Draw a cylinder from the link's origin to a point of it."""
    x, y, z = end.tolist()
    length = math.hypot(x, y, z)
    if length >= _JOINT_RADIUS:
        _draw(link, 'bone', 'cylinder', end / 2,
              np.array([0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)]),
              radius=_BONE_RADIUS, length=length)


def _comment(parent: ET.Element, text: str) -> None:
    parent.append(ET.Comment(f' {text.replace("--", "- -")} '))
