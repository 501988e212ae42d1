"""`leg_fk pose`: the pose of a chain's tip for one joint vector."""

import argparse
from collections.abc import Iterable

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.chain_text import joint_range, position
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import options, text

EXAMPLES = """\
The joints stand in the order that `leg_fk list` shows. Lengths in the output are metres; the
quaternion is x y z w. Positions outside a documented range are computed as they are, and noted.

examples:
  leg_fk pose left_leg --degrees 0 0 0 0 0 0
  leg_fk pose right_leg=v1 --radians 0.1 -0.2 0 -0.5 -1e-2 0 --foot-frame sole
  leg_fk pose head_imu --degrees 0 0 0 10 0 -20 --json
  leg_fk pose arm -k my_robot.yaml --degrees 90 0.25 45"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(
        parser,
        'chain',
        '--version',
        '--foot-frame',
        '--kinematics-file',
        '--root',
        '--json',
    )
    options.add_joint_positions(parser, required=True)


def run(args: argparse.Namespace) -> int:
    """Print the pose."""
    chain = options.chosen_chain(args)
    q = options.joint_positions(args, chain) or []
    T = chain.forward(q) + 0.0  # no negative zeros
    quaternion = [value + 0.0 for value in chain.pose(q)[3:]]
    if args.json:
        print(_as_json(chain, T, quaternion))
    else:
        print(*_as_text(chain, q, T, quaternion), sep='\n')
    return 0


def _as_json(chain: Chain, T: Array, quaternion: list[float]) -> str:
    return text.as_json(
        {
            'chain': chain.name,
            'version': chain.version,
            'root_frame': chain.root_frame,
            'frame_id': chain.frame_id,
            'position': T[:3, 3].tolist(),
            'quaternion': quaternion,
            'matrix': T.tolist(),
        }
    )


def _as_text(
    chain: Chain, q: list[float], T: Array, quaternion: list[float]
) -> list[str]:
    lines = [
        f'{chain.name} {chain.version}: {chain.frame_id} in {chain.root_frame}',
        '',
    ]
    lines += text.indented(_joints(chain, q))
    lines += ['', 'matrix (translation in m)', *text.indented(text.transform(T))]
    lines += ['', _named('position (m)', 'xyz', T[:3, 3])]
    lines += [_named('quaternion  ', 'xyzw', quaternion)]
    for note in text.range_notes(chain, q):
        lines += ['', *text.wrapped(note)]
    return lines


def _joints(chain: Chain, q: list[float]) -> list[str]:
    """Return a line for each joint: its position, its range, and whether it is outside."""
    outside = chain.out_of_range(q)
    rows = []
    for name, link, value in zip(chain.joint_names, chain.joints, q, strict=True):
        bounds = joint_range(link)
        found = f'range {bounds}' if bounds else ''
        remark = '<- outside' if name in outside else ''
        rows.append([name, *position(link, value).split(), found, remark])
    return text.columns(rows)


def _named(title: str, names: str, values: Iterable[float]) -> str:
    cells = zip(names, text.numbers(values), strict=True)
    return '  '.join([title, *(f'{name}  {number}' for name, number in cells)])
