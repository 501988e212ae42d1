"""`leg_fk pose`: the pose of a chain's tip for one joint vector."""

import argparse

from icub_leg_fk.tools import options, text

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
    options.add(parser, 'chain', '--version', '--foot-frame', '--kinematics-file', '--json')
    options.add_joint_positions(parser, required=True)


def run(args: argparse.Namespace) -> int:
    """Print the pose."""
    _, chain = options.load_chain(args)
    q = options.joint_positions(args, chain) or []
    T = chain.forward(q) + 0.0  # no negative zeros
    quaternion = [value + 0.0 for value in chain.pose(q)[3:]]
    if args.json:
        print(text.as_json({
            'chain': chain.name, 'version': chain.version, 'root_frame': chain.root_frame,
            'frame_id': chain.frame_id, 'position': T[:3, 3].tolist(), 'quaternion': quaternion,
            'matrix': T.tolist()}))
        return 0
    outside = chain.out_of_range(q)
    joints = text.columns([
        [name, *text.position(link, value).split(),
         f'range {text.joint_range(link)}' if text.joint_range(link) else '',
         '<- outside' if name in outside else '']
        for name, link, value in zip(chain.joint_names, chain.joints, q, strict=True)])
    x, y, z, *xyzw = (text.fixed(value, 7) for value in (*T[:3, 3].tolist(), *quaternion))
    matrix = text.matrix([[text.fixed(value, 7) for value in row] for row in T[:3].tolist()]
                         + [['0', '0', '0', '1']], '  ')
    print(f'{chain.name} {chain.version}: {chain.frame_id} in {chain.root_frame}', '',
          *text.indented(joints), '', 'matrix (translation in m)', *text.indented(matrix), '',
          *text.columns([['position (m)', 'x', x, 'y', y, 'z', z]]), *text.columns(
              [['quaternion  ', *(word for pair in zip('xyzw', xyzw) for word in pair)]]),
          *(line for note in text.range_notes(chain, q) for line in ('', *text.wrapped(note))),
          sep='\n')
    return 0
