"""`leg_fk urdf`: chains as a URDF, joint for joint.

The URDF link after joint i is frame i turned (or slid) by the joint alone, so the rest of the DH
link, A_i at q = 0, becomes the fixed origin of the next joint. Every joint moves along its z.
"""

import argparse
from collections import Counter
from collections.abc import Mapping
import math
from pathlib import Path
from xml.etree import ElementTree as ET

from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, DHLink
from icub_leg_fk.kinematics.catalog import ChainVersion
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import SOLE_OUTLINE
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
  leg_fk urdf left_leg right_leg head_imu --chain-version head_imu=v2 -o icub.urdf
  leg_fk urdf -k my_robot.yaml --version v1 --name my_robot"""

_PLACEHOLDER = '50000'  # effort and velocity, which URDF demands and no table gives
_COLOURS = {'bone': '0.82 0.82 0.85 1', 'joint': '0.25 0.27 0.32 1', 'tip': '0.90 0.45 0.10 1'}
_BONE_RADIUS, _JOINT_RADIUS, _TIP_RADIUS, _SOLE_THICKNESS = 0.012, 0.022, 0.015, 0.02  # m
_NOWHERE = np.zeros(3)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('chains', metavar='CHAIN', nargs='*',
                        help='chains to write (default: all that have the version asked for)')
    parser.add_argument('--name', help='name of the robot (default: icub, or that of your file)')
    options.add(parser, '--version', '--chain-version', '--kinematics-file')
    options.add_output(parser, 'file to write (default: standard output)')
    parser.set_defaults(version=options.DEFAULT_VERSION)


def run(args: argparse.Namespace) -> int:
    """Write the URDF."""
    catalog = options.load_catalog(args)
    robot = args.name or ('icub' if args.kinematics_file is None else Path(catalog.file).stem)
    if not robot.isprintable():
        raise LegFKError(f'--name: found {robot!r}, allowed: printable text')
    write_text(args.output, urdf_text(robot, _tables(catalog, args)), force=args.force)
    return 0


def _tables(catalog: Catalog, args: argparse.Namespace) -> dict[tuple[str, str], ChainVersion]:
    """Return the tables asked for, by chain and version."""
    own = options.own_versions(args, args.chains or list(catalog.chains))
    names = args.chains or [name for name, entry in catalog.chains.items()
                            if name in own or args.version in entry.versions]
    if not names:
        raise UnknownNameError('version', args.version, dict.fromkeys(
            version for entry in catalog.chains.values() for version in entry.versions))
    chains = [catalog.chain(name, own.get(name, args.version)) for name in names]
    return {(chain.name, chain.version): catalog.entry(chain.name).versions[chain.version]
            for chain in chains}


def urdf_text(robot: str, tables: Mapping[tuple[str, str], ChainVersion]) -> str:
    """Return the URDF of a robot of some chains, at least one, by chain and version.

    Raises:
        LegFKError: the chains have different roots or share a name, or a joint has no range.
    """
    roots = sorted({table.root_frame for table in tables.values()})
    if len(roots) > 1:
        raise LegFKError(f'a URDF has one root: found {", ".join(roots)}; choose chains with the '
                         'same root_frame')
    model = ET.Element('robot', name=robot)
    _comment(model, 'Written by `leg_fk urdf` from the Denavit-Hartenberg tables of '
             f'{", ".join(map(" ".join, tables))}.')
    _comment(model, 'Links have no inertia; effort and velocity limits are placeholders.')
    for name, rgba in _COLOURS.items():
        ET.SubElement(ET.SubElement(model, 'material', name=name), 'color', rgba=rgba)
    base = ET.SubElement(model, 'link', name=roots[0])
    joints: dict[str, tuple[str, DHLink, Array]] = {}
    for (chain, _), table in tables.items():
        _draw_bone(base, table.T_root_0[:3, 3])
        _add_chain(model, joints, chain, table)
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


def _add_chain(model: ET.Element, joints: dict[str, tuple[str, DHLink, Array]], chain: str,
               table: ChainVersion) -> None:
    """Add a chain; `joints` are those that are there, with parent and origin: each is there once.

    A joint that is elsewhere in another chain is refused.
    """
    origin, parent = table.T_root_0, table.root_frame
    names = iter(table.joint_names)
    for link in table.links:
        if link.is_fixed:
            origin = origin @ link.transform()
            continue
        name = next(names)
        if name in joints:
            other_parent, other, place = joints[name]
            # It may be elsewhere along and about its axis, which makes no difference to it.
            T = np.linalg.inv(place) @ origin
            off_axis = np.hstack((T[:3, 2] - (0, 0, 1), T[:2, 3] * (not link.is_prismatic)))
            if np.abs(off_axis).max() > 1e-9 or (parent, link.joint_type, link.sign) != (
                    other_parent, other.joint_type, other.sign):
                raise LegFKError(f'joint {name!r} of chain {chain} is elsewhere in another chain; '
                                 'choose chains that agree on the joints they share')
            origin = T @ link.transform()
        else:
            joints[name] = parent, link, origin
            _add_joint(model, chain, name, link, origin, parent)
            origin = link.transform()
            body = ET.SubElement(model, 'link', name=f'{name}_link')
            _draw(body, 'joint', 'sphere', radius=_JOINT_RADIUS)
            _draw_bone(body, origin[:3, 3])
        parent = f'{name}_link'
    for name, frame in table.tip_frames.items():
        _place(ET.SubElement(model, 'joint', name=f'{frame.frame}_joint', type='fixed'),
               origin @ table.T_n_tip @ frame.T_dh_tip, parent, frame.frame)
        tip = ET.SubElement(model, 'link', name=frame.frame)
        if name == 'sole':
            corners = np.array(SOLE_OUTLINE)
            low, high = corners.min(axis=0), corners.max(axis=0) + (0.0, 0.0, _SOLE_THICKNESS)
            _draw(tip, 'tip', 'box', (low + high) / 2, size='{:g} {:g} {:g}'.format(*high - low))
        elif 'sole' not in table.tip_frames:
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
    ET.SubElement(joint, 'axis', xyz=f'0 0 {link.sign}')
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
