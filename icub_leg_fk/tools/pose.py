"""`leg_fk pose`: the pose of a chain's tip for one joint vector."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from icub_leg_fk.tools.chain_arguments import (
    add_chain,
    add_joint_positions,
    add_json,
    joint_positions,
    load_chain,
)

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Chain
    from icub_leg_fk.kinematics.rotation import Array

HELP = 'the pose of a foot, or any tip, for one joint vector'
EXAMPLES = """\
The joints stand in the order that `leg_fk list` shows. Lengths in the output are metres; the
quaternion is x y z w. Positions outside a documented range are computed as they are, and noted.

examples:
  leg_fk pose left_leg --degrees 0 0 0 0 0 0
  leg_fk pose right_leg --version v1 --radians 0.1 -0.2 0 -0.5 -1e-2 0 --foot-frame sole
  leg_fk pose head_imu --version v2 --degrees 0 0 0 10 0 -20 --json
  leg_fk pose arm -k my_robot.yaml --version v1 --degrees 90 0.25 45"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_chain(parser)
    add_joint_positions(parser, required=True)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the pose."""
    from icub_leg_fk.kinematics import matrix_to_quaternion
    from icub_leg_fk.tools.text import json_text

    _, chain = load_chain(args)
    q = joint_positions(args, chain) or []
    T = chain.forward(q) + 0.0  # no negative zeros
    quaternion = matrix_to_quaternion(T[:3, :3])
    if quaternion @ chain.pose(q)[3:] < 0.0:  # of the two the one nearer to that at q = 0
        quaternion = 0.0 - quaternion
    if args.json:
        print(json_text({
            'chain': chain.name, 'version': chain.version, 'root_frame': chain.root_frame,
            'tip_frame': chain.tip_frame, 'position': T[:3, 3].tolist(),
            'quaternion': quaternion.tolist(), 'matrix': T.tolist()}))
    else:
        print('\n'.join(_as_text(chain, q, T, quaternion)))
    return 0


def _as_text(chain: Chain, q: list[float], T: Array, quaternion: Array) -> list[str]:
    from icub_leg_fk.tools.text import (
        columns,
        fixed,
        indented,
        matrix,
        position_text,
        range_notes,
        range_text,
    )

    outside = chain.out_of_range(q)
    joints = list(zip(chain.joint_names, chain.joints, q, strict=True))
    table = columns([
        [name, *position_text(link, value).split(),
         f'range {range_text(link)}' if range_text(link) else '',
         '<- outside' if name in outside else '']
        for name, link, value in joints])
    lines = [f'{chain.name} {chain.version}: {chain.tip_frame} in {chain.root_frame}', '']
    lines += indented(table)
    lines += ['', 'matrix (translation in m)']
    lines += indented(matrix([[fixed(value, 7) for value in row] for row in T[:3].tolist()]
                             + [['0', '0', '0', '1']], gap='  '))
    values = [fixed(value, 7) for value in (*T[:3, 3].tolist(), *quaternion.tolist())]
    lines += ['', *columns([['position (m)', 'x', values[0], 'y', values[1], 'z', values[2]]]),
              *columns([['quaternion  ', *(word for pair in zip('xyzw', values[3:], strict=True)
                                           for word in pair)]])]
    for note in range_notes(chain, q):
        lines += ['', *note.splitlines()]
    return lines
