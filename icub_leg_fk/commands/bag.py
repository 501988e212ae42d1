"""`leg_fk bag`: adds the poses of the feet to recordings, several at a time."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import as_completed, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from inspect import signature
from multiprocessing import active_children, get_context
import os
from pathlib import Path
import signal
import sys
from typing import Any, NamedTuple

from icub_leg_fk.errors import LegFKError, OutputFileError
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.tools import options
from icub_leg_fk.tools.add_poses import add_foot_poses, Summary
from icub_leg_fk.tools.bags import STORAGES
from icub_leg_fk.tools.command_line import complaint
from icub_leg_fk.tools.output_file import refuse_option_like
from icub_leg_fk.tools.progress import shown_progress
from icub_leg_fk.tools.text import columns, indented

EXAMPLES = """\
Reads rosbag2 bags, split and compressed ones too, as directories or single files. Copies every
topic as it is and adds foot_pose_publisher/<tip>/pose after each message of joint states, in
their namespace, byte for byte what the node would send; one with a zero stamp is stamped with the
time it was recorded at. OUT is a directory, or a file if it ends in .mcap or .db3. It appears
when it is complete. Of a CSV file or a directory of yarpdatadumper it gets the joint states, too.

examples:
  leg_fk bag walking walking_with_poses
  leg_fk bag walking.mcap walking_with_poses.mcap --version v1 --foot-frame sole
  leg_fk bag walking of_this_very_robot --description-from-topic
  leg_fk bag two_robots with_poses --joint-topic /icub1/joint_states --joint-prefix icub1/
  leg_fk bag walking poses --only-poses --twist --tf --storage mcap
  leg_fk bag walking all_poses --chains left_leg right_leg head_imu=v2
  leg_fk bag monday/* --out-dir with_poses --jobs 4"""


class _Task(NamedTuple):
    """A bag to read and the bag to make of it."""

    source: str
    target: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.usage = (
        'leg_fk bag IN OUT [options]\n'
        '       leg_fk bag IN... --out-dir DIR [--jobs N] [options]'
    )
    parser.add_argument(
        'bags',
        metavar='BAG',
        nargs='+',
        type=options.path,
        help='the bag to read and the bag to '
        'make; with --out-dir, all are bags to read',
    )
    parser.add_argument(
        '--out-dir',
        metavar='DIR',
        type=options.path,
        help='where each gets one of the same name',
    )
    parser.add_argument(
        '--jobs',
        metavar='N',
        type=_positive_integer,
        default=1,
        help='bags to work on at a time (default: 1)',
    )
    options.add_recording(parser)
    options.add(parser, '--force')
    parser.add_argument(
        '--namespace',
        metavar='NAME',
        help='of the topics that are added (default: that of the joint states)',
    )
    parser.add_argument(
        '--frame-prefix', metavar='PREFIX', default='', help='put before every frame id'
    )
    parser.add_argument(
        '--joint-timeout',
        metavar='S',
        type=float,
        default=DEFAULT_TIMEOUT,
        help='how far a joint may lag the newest of its chain, or else there is '
        f'no pose; 0 turns this off (default: {DEFAULT_TIMEOUT})',
    )
    parser.add_argument(
        '--storage',
        metavar='{mcap,sqlite3}',
        choices=('mcap', 'sqlite3'),
        help='storage of the new bag (default: as OUT says, or as in the old one)',
    )
    parser.add_argument(
        '--twist',
        action='store_true',
        help='also add the velocities of the tips, from the joint velocities',
    )
    parser.add_argument('--tf', action='store_true', help='also add the poses to /tf')
    parser.add_argument(
        '--only-poses',
        action='store_true',
        help='leave out everything but what is added',
    )
    parser.add_argument(
        '--replace-poses',
        action='store_true',
        help='leave out the poses that the bag has already',
    )


def run(args: argparse.Namespace) -> int:
    """Convert the bags."""
    tasks = _tasks(args)
    given = {name: value for name, value in vars(args).items() if value is not None}
    settings = {
        name: given[name]
        for name in signature(add_foot_poses).parameters.keys() & given
    }
    failed = False
    for task, outcome in _outcomes(tasks, settings, args.jobs):
        if isinstance(outcome, Summary):
            print('\n'.join(_summary_lines(outcome)), flush=True)
        else:
            failed = True
            print(
                f'leg_fk: error: {_fault(task, outcome, len(tasks))}',
                file=sys.stderr,
                flush=True,
            )
    return 2 if failed else 0


def _outcomes(
    tasks: Sequence[_Task], settings: Mapping[str, Any], jobs: int
) -> Iterator[tuple[_Task, Summary | LegFKError]]:
    """Yield each task with what came of it, some worked on at a time."""
    if jobs > 1 and len(tasks) > 1:
        yield from _outcomes_of_jobs(tasks, settings, min(jobs, len(tasks)))
        return
    for task in tasks:
        with shown_progress(Path(task.source).name) as progress:
            outcome = _attempt(task, {**settings, 'progress': progress})
        yield task, outcome


def _outcomes_of_jobs(
    tasks: Sequence[_Task], settings: Mapping[str, Any], jobs: int
) -> Iterator[tuple[_Task, Summary | LegFKError]]:
    """Yield each task with what came of it, in the order in which they are done."""
    pool = ProcessPoolExecutor(jobs, get_context('spawn'), _begin_worker)
    try:
        futures = {pool.submit(_attempt, task, settings): task for task in tasks}
        for future in as_completed(futures):
            try:
                yield futures[future], future.result()
            except BrokenProcessPool:
                yield futures[future], LegFKError('not done: a worker was killed')
        pool.shutdown()
    except BaseException:
        for worker in active_children():
            worker.terminate()
        pool.shutdown(cancel_futures=True)
        raise


def _attempt(task: _Task, settings: Mapping[str, Any]) -> Summary | LegFKError:
    """Return what came of one bag."""
    try:
        return add_foot_poses(*task, **settings)
    except LegFKError as error:
        return error


def _begin_worker() -> None:
    """Let a worker that is told to stop take back what it has begun."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command tells its workers itself
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))


def _tasks(args: argparse.Namespace) -> list[_Task]:
    """Return which bag is to become which."""
    if args.out_dir is not None:
        return _tasks_of_directory(args.bags, args.out_dir, args.storage)
    if len(args.bags) != 2:
        count = f'{len(args.bags)} bag{"s" * (len(args.bags) != 1)}'
        raise LegFKError(f'{count} without --out-dir; allowed: two, IN and OUT')
    return [_Task(*args.bags)]


def _tasks_of_directory(
    bags: Sequence[str], directory: str, storage: str
) -> list[_Task]:
    """Return tasks that make of each bag one of its name in a directory, which is made."""
    refuse_option_like(directory)
    try:
        Path(directory).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputFileError(
            directory, f'cannot be made: {str(error.strerror).lower()}'
        ) from error
    endings = {name: ending for ending, name in STORAGES.items()}
    sources: dict[str, str] = {}  # by target
    for bag in bags:
        path = Path(os.path.abspath(bag))
        if storage and path.suffix in STORAGES:
            path = path.with_suffix(endings[storage])
        target = str(Path(directory, path.name))
        if target in sources:
            raise OutputFileError(
                target, 'several bags would get this name; allowed: one'
            )
        sources[target] = bag
    return [_Task(source, target) for target, source in sources.items()]


def _positive_integer(text: str) -> int:
    if not text.strip().isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(
            f'found {text.strip()!r}, allowed: integers from 1 on'
        )
    return int(text)


def _fault(task: _Task, error: LegFKError, tasks: int) -> str:
    """Return one line on what went wrong with a bag, which is named if there are several."""
    line = complaint(error)
    return (
        line if tasks == 1 or line.startswith(task.source) else f'{task.source}: {line}'
    )


def _summary_lines(summary: Summary) -> list[str]:
    """Return the closing summary, line by line."""
    rows = [(str(summary.copied), 'messages copied')]
    rows += [
        (str(count), f'added on {topic}') for topic, count in summary.added.items()
    ]
    lines = columns(rows)
    lines += [f'warning: {warning}' for warning in summary.warnings]
    lines += [f'note: {note}' for note in summary.notes]
    speed = summary.recorded / max(summary.took, 1e-9)
    lines.append(
        f'{summary.recorded:.3f} s of recording in {summary.took:.3f} s, {speed:.1f} '
        'seconds of recording per second'
    )
    return [f'{summary.source} -> {summary.target}', *indented(lines)]
