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
from typing import Any

from icub_leg_fk.errors import LegFKError, OutputFileError
from icub_leg_fk.stream.configuration import DEFAULT_FRAME, DEFAULT_TIMEOUT, LEGS
from icub_leg_fk.tools import options
from icub_leg_fk.tools.add_poses import add_foot_poses, STORAGES, Summary
from icub_leg_fk.tools.text import columns, indented

EXAMPLES = """\
Reads rosbag2 bags, split and compressed ones too, as directories or single files. Copies every
topic as it is and adds /foot_pose_publisher/<tip>/pose behind each message of joint states, byte
for byte what the node would send; one with a zero stamp is stamped with the time it was recorded
at. OUT is a directory, or a file if it ends in .mcap or .db3. It appears when it is complete.

examples:
  leg_fk bag walking walking_with_poses
  leg_fk bag walking.mcap walking_with_poses.mcap --version v1 --foot-frame sole
  leg_fk bag walking poses --only-poses --twist --tf --storage mcap
  leg_fk bag walking all_poses --chains left_leg head_imu --chain-version head_imu=v2
  leg_fk bag monday/* --out-dir with_poses --jobs 4"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.usage = ('leg_fk bag IN OUT [options]\n'
                    '       leg_fk bag IN... --out-dir DIR [--jobs N] [options]')
    parser.add_argument('bags', metavar='BAG', nargs='+', help='the bag to read and the bag to '
                        'make; with --out-dir, all are bags to read')
    parser.add_argument('--out-dir', metavar='DIR', help='where each gets one of the same name')
    parser.add_argument('--jobs', metavar='N', type=_positive_integer, default=1,
                        help='bags to work on at a time (default: 1)')
    options.add(parser, '--chains', '--version', '--foot-frame', '--joint-topic', '--kinematics-file', '--force')
    parser.set_defaults(chains=LEGS, version='', foot_frame=DEFAULT_FRAME)
    parser.add_argument('--frame-prefix', metavar='PREFIX', default='',
                        help='put before every frame id')
    parser.add_argument('--joint-timeout', metavar='S', type=float, default=DEFAULT_TIMEOUT,
                        help='age of a joint beside the newest of its chain above which there is '
                             f'no pose; 0 turns this off (default: {DEFAULT_TIMEOUT})')
    parser.add_argument('--storage', metavar='{mcap,sqlite3}', choices=('mcap', 'sqlite3'),
                        default='',
                        help='storage of the new bag (default: as OUT says, or as in the old one)')
    for flag, purpose in (
            ('--twist', 'also add the velocities of the tips, from the joint velocities'),
            ('--tf', 'also add the poses to /tf'),
            ('--only-poses', 'leave out everything but what is added'),
            ('--replace-poses', 'leave out the poses that the bag has already')):
        parser.add_argument(flag, action='store_true', help=purpose)


def run(args: argparse.Namespace) -> int:
    """Convert the bags."""
    tasks = _tasks(args)
    settings = {name: value for name, value in vars(args).items()
                if name in signature(add_foot_poses).parameters}
    shows_progress = len(tasks) == 1 and sys.stderr is not None and sys.stderr.isatty()
    settings['progress'] = _show_share if shows_progress else None
    failed = False
    for (source, _), outcome in _outcomes(tasks, settings, min(args.jobs, len(tasks))):
        if isinstance(outcome, Summary):
            print('\n'.join(_summary_lines(outcome)), flush=True)
            continue
        failed = True
        line = ' '.join(str(outcome).split())
        named = '' if line.startswith(str(source)) or len(tasks) == 1 else f'{source}: '
        print(f'leg_fk: error: {named}{line}', file=sys.stderr, flush=True)
    return 2 if failed else 0


def _show_share(share: float) -> None:
    print(f'\r{100 * min(share, 1.0):3.0f} % \033[K', end='', file=sys.stderr, flush=True)


def _outcomes(tasks: Sequence[tuple[Path, Path]], settings: Mapping[str, Any], jobs: int
              ) -> Iterator[tuple[tuple[Path, Path], Summary | LegFKError]]:
    """Yield each task with what came of it, some worked on at a time."""
    if jobs == 1:
        for task in tasks:
            yield task, _attempt(task, settings)
        return
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


def _attempt(task: tuple[Path, Path], settings: Mapping[str, Any]) -> Summary | LegFKError:
    """Return what came of one bag; its progress is no more to be seen."""
    try:
        return add_foot_poses(*task, **settings)
    except LegFKError as error:
        return error
    finally:
        if settings['progress'] is not None:
            print('\r\033[K', end='', file=sys.stderr, flush=True)


def _begin_worker() -> None:
    """Let a worker that is told to stop take back what it has begun."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command tells its workers itself
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))


def _tasks(args: argparse.Namespace) -> list[tuple[Path, Path]]:
    """Return which bag is to become which."""
    if args.out_dir is None:
        if len(args.bags) != 2:
            count = f'{len(args.bags)} bag{"s" * (len(args.bags) != 1)}'
            raise LegFKError(f'{count} without --out-dir; allowed: two, IN and OUT')
        source, target = args.bags
        return [(Path(source), Path(target))]
    out_dir = Path(args.out_dir)
    try:
        out_dir.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputFileError(f'--out-dir {out_dir}: {error.strerror}') from error
    endings = {storage: ending for ending, storage in STORAGES.items()}
    tasks: dict[Path, Path] = {}  # source by target
    for bag in args.bags:
        path = Path(os.path.abspath(bag))
        if args.storage and path.suffix in STORAGES:
            path = path.with_suffix(endings[args.storage])
        if (target := out_dir / path.name) in tasks:
            raise OutputFileError(f'{target}: several bags would get this name; allowed: one')
        tasks[target] = Path(bag)
    return [(source, target) for target, source in tasks.items()]


def _positive_integer(text: str) -> int:
    if not text.strip().isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: integers from 1 on')
    return int(text)


def _summary_lines(summary: Summary) -> list[str]:
    """Return the closing summary, line by line."""
    rows = [(str(summary.copied), 'messages copied'),
            *((str(count), f'added on {topic}') for topic, count in summary.added.items()),
            *((str(count), 'time steps back: held joints forgotten' if reason == 'time_jump'
               else f'joint states rejected: {reason}')
              for reason, count in summary.rejected.items()),
            *((str(count), f'joint states gave no {"twist" if reason == "no_velocity" else "pose"}'
               f' of {chain}: {reason} ({joints})')
              for chain, reasons in summary.held_back.items()
              for reason, (count, joints) in reasons.items())]
    speed = summary.recorded / max(summary.took, 1e-9)
    return [f'{summary.source} -> {summary.target}', *indented([
        *columns(rows), *(f'note: {note}' for note in summary.notes),
        f'{summary.recorded:.3f} s of recording in {summary.took:.3f} s, {speed:.1f} seconds of '
        'recording per second'])]
