"""`leg_fk bag`: copies bags and adds the poses of the feet."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import re
import sys
from typing import TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, OutputFileError
from icub_leg_fk.tools.chain_arguments import (
    add_chain_version,
    add_kinematics_file,
    DEFAULT_VERSION,
    own_versions,
)

if TYPE_CHECKING:
    from icub_leg_fk.ros.configuration import Configuration
    from icub_leg_fk.tools.bags.conversion import Conversion
    from icub_leg_fk.tools.bags.jobs import Outcome, Task

HELP = 'copy a bag and add the poses of the feet, as the node would have published them'
EXAMPLES = """\
Reads rosbag2 bags, mcap and sqlite3: split, compressed, unfinished or damaged ones too. Copies
every topic as it is and adds /foot_pose_publisher/<tip>/pose behind each message of joint states,
by the node's own rules and bit for bit what the node would give; a message with a zero stamp is
stamped with the time it was recorded at. OUT is a directory, or a single file if it ends in
.mcap or .db3. It appears when it is complete; until then, all work is in .OUT.partial beside it.

exit status: 0, 1 if a part of a bag could not be read (the output has all the rest, and the
summary says what is missing), 2 if there is no output.

examples:
  leg_fk bag walking walking_with_poses
  leg_fk bag walking.mcap walking_with_poses.mcap --version v1 --foot-frame sole
  leg_fk bag walking poses --only-poses --twist --tf --storage mcap
  leg_fk bag head head_poses --chains head_imu --version v2
  leg_fk bag walking all_poses --chains left_leg head_imu --chain-version head_imu=v2
  leg_fk bag monday/* --out-dir with_poses --jobs 4"""

PARTLY_READ = 1  # the exit status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.usage = ('leg_fk bag IN OUT [options]\n'
                    '       leg_fk bag IN... --out-dir DIR [--jobs N] [options]')
    parser.add_argument('bags', metavar='BAG', nargs='+', help='the bag to read and the bag to '
                        'make; with --out-dir, all are bags to read')
    parser.add_argument('--out-dir', metavar='DIR', help='make a bag of the same name in DIR of '
                        'every bag')
    parser.add_argument('--jobs', metavar='N', type=_positive_integer, default=1,
                        help='bags to work on at a time (default: 1)')
    parser.add_argument('--force', action='store_true',
                        help='replace an existing output bag, once the new one is complete')
    parser.add_argument('--joint-topic', metavar='TOPIC', default='/joint_states',
                        help='topic of the joint states (default: /joint_states)')
    parser.add_argument('--chains', metavar='CHAIN', nargs='+', default=['left_leg', 'right_leg'],
                        help='chains to add (default: left_leg right_leg)')
    parser.add_argument('--version', metavar='VERSION', default=DEFAULT_VERSION,
                        help=f'version of the chains (default: {DEFAULT_VERSION})')
    add_chain_version(parser)
    parser.add_argument('--foot-frame', metavar='{dh,sole}', default='dh',
                        help="axes of the feet: the table's last frame (the default), or the sole")
    parser.add_argument('--frame-prefix', metavar='PREFIX', default='',
                        help='put before every frame id')
    parser.add_argument('--joint-timeout', metavar='S', type=float, default=0.5,
                        help='age of a joint beside the newest of its chain above which there is '
                             'no pose; 0 turns this off (default: 0.5)')
    parser.add_argument('--twist', action='store_true',
                        help='also add the velocities of the tips, from the joint velocities')
    parser.add_argument('--tf', action='store_true', help='also add the poses to /tf')
    parser.add_argument('--only-poses', action='store_true',
                        help='leave out everything but what is added')
    parser.add_argument('--storage', metavar='{mcap,sqlite3}', choices=('mcap', 'sqlite3'),
                        help='storage of the new bag (default: as OUT says, or as in the old one)')
    add_kinematics_file(parser)


def run(args: argparse.Namespace) -> int:
    """Convert the bags."""
    from icub_leg_fk.tools.bags.conversion import Conversion

    tasks = _tasks(args)
    conversion = Conversion(_configuration(args), args.joint_topic, args.only_poses,
                            args.storage or '', args.force)
    return _convert(tasks, conversion, args.jobs)


def _positive_integer(text: str) -> int:
    if not text.strip().isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: integers from 1 on')
    return int(text)


def _tasks(args: argparse.Namespace) -> list[Task]:
    """Return which bag is to become which."""
    from icub_leg_fk.tools.bags.jobs import Task

    if args.out_dir is None:
        if len(args.bags) != 2:
            raise LegFKError(f'found {len(args.bags)} bags without --out-dir, allowed: '
                             'two, IN and OUT')
        source, target = args.bags
        return [Task(Path(source), Path(target))]
    tasks = [Task(Path(bag), Path(args.out_dir) / _name(Path(bag), args.storage))
             for bag in args.bags]
    targets = [task.target for task in tasks]
    for target in targets:
        if targets.count(target) > 1:
            raise OutputFileError(f'{target}: found several bags that would get this name, '
                                  'allowed: one')
    return tasks


def _name(bag: Path, storage: str | None) -> str:
    """Return the name of the new bag: that of the old one, with the ending of its storage."""
    from icub_leg_fk.tools.bags.reader import KINDS

    name = re.sub(r'(\.mcap|\.db3)\.zstd$', r'\1', os.path.basename(os.path.abspath(bag)))
    stem, ending = os.path.splitext(name)
    if storage and ending in KINDS:
        return stem + next(ending for ending, kind in KINDS.items() if kind == storage)
    return name


def _configuration(args: argparse.Namespace) -> Configuration:
    """Return what the node's parameters of the same meaning would amount to."""
    from dataclasses import replace

    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.ros.configuration import Configuration, version_parameter

    catalog = Catalog.load(args.kinematics_file)
    values = {
        'chains': args.chains, 'version': args.version, 'foot_frame': args.foot_frame,
        'frame_prefix': args.frame_prefix, 'joint_timeout': args.joint_timeout,
        'stamp_source': 'message', 'publish_tf': False, 'publish_twist': args.twist,
        'publish_markers': False}
    values |= {version_parameter(chain): version
               for chain, version in own_versions(args, args.chains).items()}
    try:
        configuration = Configuration.from_parameters(values, catalog)
    except LegFKError as error:
        raise LegFKError(_as_options(str(error))) from error
    return replace(configuration, publish_tf=args.tf)  # here that needs no broadcaster


def _as_options(text: str) -> str:
    """Return a text on parameters of the node as one on options of the command."""
    text = re.sub(r'^parameter (\w+)\.version', r'--chain-version \1', text)
    text = re.sub(r'^parameter (\w+)', lambda match: '--' + match[1].replace('_', '-'), text)
    return re.sub(r'\(or set (\w+)\.version\)', r'(or --chain-version \1=VERSION)', text)


def _convert(tasks: list[Task], conversion: Conversion, jobs: int) -> int:
    """Convert the bags, tell about each, and return the exit status."""
    from icub_leg_fk.tools.bags.conversion import Summary
    from icub_leg_fk.tools.bags.jobs import convert_all, convert_one
    from icub_leg_fk.tools.bags.report import ProgressBar, summary_lines

    bar = ProgressBar()
    status = 0

    def tell(task: Task, outcome: Outcome) -> None:
        nonlocal status
        bar.clear()
        if isinstance(outcome, Summary):
            print('\n'.join(summary_lines(task.source, outcome)), flush=True)
            status = max(status, PARTLY_READ if outcome.damage else 0)
        elif len(tasks) == 1:
            raise LegFKError(outcome)
        else:
            line = ' '.join(outcome.split())
            print(f'leg_fk: error: {task.source}: {line}', file=sys.stderr, flush=True)
            status = 2

    try:
        if jobs > 1 and len(tasks) > 1:
            convert_all(tasks, conversion, jobs, bar.show, tell)
        else:
            for index, task in enumerate(tasks):
                bar.span = (index / len(tasks), (index + 1) / len(tasks))
                tell(task, convert_one(task, conversion, bar.show))
    finally:
        bar.clear()
    return status
