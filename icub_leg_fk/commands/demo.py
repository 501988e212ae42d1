"""`leg_fk demo`: the node in its own process, a walk played to it over DDS, live poses."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
import os
from pathlib import Path
import shutil
import sys

from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import Catalog, Chain, config_file
from icub_leg_fk.tools import options
from icub_leg_fk.tools import recording as recordings
from icub_leg_fk.tools import replay as replays
from icub_leg_fk.tools.bags import import_rosbags
from icub_leg_fk.tools.drawing import check_output, feet_figure, save_picture
from icub_leg_fk.tools.output_file import check_target, is_bag
from icub_leg_fk.tools.recording import JointRecording
from icub_leg_fk.tools.replay import Answers, Replay
import numpy as np

EXAMPLES = """\
Starts the node foot_pose_publisher in its own process, plays a synthetic walking gait, or a
recording, to it over DDS, shows the poses of both feet as they arrive, and at the end draws them.
It talks inside this machine only, in a namespace of its own, and in a ROS_DOMAIN_ID of its own
unless you have set one: no robot is disturbed. Exit status 0 if every pose arrived. A recording
is a CSV file with a column `time` in seconds and one per leg joint, in radians.

examples:
  leg_fk demo
  leg_fk demo --save walk        keeps the joint states as a bag, for leg_fk bag and plot
  leg_fk demo --version v1 --seconds 3 -o v1.png
  leg_fk demo --recording walking.csv"""

_COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_COLORS = {'left foot': '\x1b[38;5;97m', 'right foot': '\x1b[38;5;172m', '': '\x1b[2m'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--recording', metavar='FILE', type=Path,
                        help='CSV file to play, in its own timing (default: a synthetic gait)')
    parser.add_argument('--seconds', metavar='S', type=options.number_between(0.1, 3600),
                        help='how long to play (default: the whole recording)')
    parser.add_argument('--save', metavar='DIR', type=Path,
                        help='keep the joint states as a rosbag2 bag')
    options.add(parser, '--version', '--foot-frame')
    options.add_output(parser, 'picture to write, .png, .svg or .pdf (default: demo.png, which is '
                       'replaced)')
    parser.set_defaults(version=options.DEFAULT_VERSION, foot_frame='dh')


def run(args: argparse.Namespace) -> int:
    """Give the demonstration; return 1 if a pose is missing or the node failed."""
    picture, force = Path(args.output or 'demo.png'), args.force or args.output is None
    check_output(picture, force)
    if args.save:
        import_rosbags()
        check_target(args.save, force=args.force, may_replace=is_bag)
    catalog = Catalog.load()
    chains = [catalog.chain(name, args.version, args.foot_frame) for name in options.LEGS]
    recording = recordings.read_csv(
        args.recording or config_file('examples/synthetic_walk.csv'),
        [name for chain in chains for name in chain.joint_names])
    if args.seconds is not None:
        recording = recording.first(args.seconds)
    domain, namespace = replays.stay_on_this_machine(), f'/leg_fk_demo_{os.getpid()}'
    print(f'iCub legs {args.version}: {len(recording.times)} JointState messages to '
          f'foot_pose_publisher, poses back over DDS\n'
          f'(this machine only, ROS_DOMAIN_ID {domain}, namespace {namespace})\n', flush=True)
    try:
        replay, whole = _play(namespace, recording, chains, args)
    except replays.DemoError as error:
        print(f'leg_fk: error: {error}', file=sys.stderr)
        return 1
    status = conclude(replay.answers, recording.times[:len(replay.sent)].tolist(), whole)
    if whole and all(answers.arrived for answers in replay.answers):
        tracks = [replace(recording.track(chain), received=answers.poses).where(
            np.isfinite(answers.latencies)) for chain, answers in zip(chains, replay.answers)]
        soles = {chain.name: catalog.chain(chain.name, args.version, 'sole') for chain in chains}
        title = f'{args.recording.name if args.recording else "synthetic gait"}   {args.version}'
        save_picture(lambda: feet_figure(tracks, default_instants(tracks), title, soles),
                     picture, force=force)
        print(f'picture       {picture}', flush=True)
    if whole and args.save:
        recordings.write_joint_states(args.save, replay.sent, force=args.force)
        print(f'bag           {args.save}', flush=True)
    return status


def _play(namespace: str, recording: JointRecording, chains: Sequence[Chain],
          args: argparse.Namespace) -> tuple[Replay, bool]:
    """Play the recording; return what came of it, and whether it was played to its end."""
    tips = tuple(chain.tip for chain in chains)
    parameters = {'version': args.version, 'foot_frame': args.foot_frame,
                  **replays.lossless(namespace, tips, replays.DEPTH)}
    with closing(Replay(recording, namespace, tips)) as replay, \
            replays.running_node(namespace, parameters) as (_, check):
        replay.wait_for_node(check)
        seconds = float(recording.times[-1] - recording.times[0])
        with LiveTable(replay.answers, seconds, chains[0].root_frame) as table:
            try:
                replay.play(table.show, table.period, check)
                return replay, True
            except KeyboardInterrupt:
                return replay, False


def conclude(answers: Sequence[Answers], times: Sequence[float], whole: bool) -> int:
    """Print the summary; return 0 if each message has its poses, 1 if not, 130 after Ctrl-C.

    `times` [s] are those of the messages sent, `whole` tells whether all were.
    """
    sent, arrived = len(times), sum(answer.arrived for answer in answers)
    lost = sent * len(answers) - arrived
    unexpected = sum(answer.unexpected for answer in answers)
    latency = 'none' if not arrived else 'median {:.2f} ms   p99 {:.2f} ms   max {:.2f} ms'.format(
        *1e3 * np.nanpercentile([answer.latencies for answer in answers], (50, 99, 100)))
    missing = (f'lost          {lost or "none"}' if whole
               else f'interrupted   {lost} of the poses had not arrived; no picture, no bag')
    print(f'\nmessages in   {sent}  in {times[-1] - times[0] if sent else 0.0:.2f} s\n'
          f'poses out     {arrived}  ({", ".join(f"{a.tip} {a.arrived}" for a in answers)})\n'
          f'{missing}\n'
          f'latency       {latency}', flush=True)
    if whole and (lost or unexpected):
        print(f'leg_fk: error: of {sent * len(answers)} poses {lost} did not arrive, and '
              f'{unexpected} arrived that belong to no message', file=sys.stderr)
        return 1
    return 0 if whole else 128 + 2  # as a shell reports SIGINT


class LiveTable:
    """Shows the newest poses every `period` [s]: on a terminal's second screen, else in lines."""

    def __init__(self, answers: Sequence[Answers], seconds: float, frame: str) -> None:
        self._feet = {each.tip.replace('_', ' '): each for each in answers}
        self._seconds, self._frame = seconds, frame
        self._live = sys.stdout.isatty() and os.environ.get('TERM', 'dumb') != 'dumb'
        self._elapsed = 0.0
        self.period = 0.1 if self._live else 1.0

    def __enter__(self) -> LiveTable:
        if self._live:
            print('\x1b[?1049h\x1b[?25l', end='', flush=True)  # second screen, no cursor
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            print(f'\x1b[?25h\x1b[?1049l{self._line()}', flush=True)

    def show(self, elapsed: float) -> None:
        """Show the state at a time since the start [s]."""
        self._elapsed = elapsed
        if not self._live:
            print(self._line(), flush=True)
            return
        width, height = shutil.get_terminal_size()
        rows = self._rows(max(0, (width - 13) // 9))
        if len(rows) > height:
            rows = [*rows[:max(0, height - 1)], ('', 'more rows: enlarge the terminal')]
        colors = {} if os.environ.get('NO_COLOR') else _COLORS
        plain = '\x1b[0m' if colors else ''
        picture = '\r\n'.join(f'{colors.get(name, "")}{row[:width]}{plain}\x1b[K'
                              for name, row in rows)
        print(f'\x1b[H{picture}\x1b[J', end='', flush=True)

    def _line(self) -> str:
        feet = '   '.join(f'{name}: ' + ('x {:+.4f}  y {:+.4f}  z {:+.4f} m'.format(
            *answers.poses[answers.newest, :3]) if answers.arrived else 'no pose yet')
            for name, answers in self._feet.items())
        return f'{self._elapsed:7.2f} s   in {self._frame}: {feet}'

    def _rows(self, columns: int) -> list[tuple[str, str]]:
        """Return the rows of the table, each with the foot it is about."""
        shown = _COLUMNS[:columns]
        rows = [('', f'poses in {self._frame}, in m'),
                ('', ' ' * 12 + ''.join(f'{name:>9}' for name in shown))]
        for name, answers in self._feet.items():
            newest = (answers.poses[answers.newest].round(4) + 0.0).tolist()  # no negative zeros
            rows.append((name, f'{name:12}' + (''.join(
                f'{value:9.4f}' for value in newest[:len(shown)])
                if answers.arrived else '  no pose yet')))
        if len(shown) < len(_COLUMNS):
            rows.append(('', f'{len(_COLUMNS) - len(shown)} more columns: widen the terminal'))
        poses = sum(answers.arrived for answers in self._feet.values())
        return [*rows, ('', ''),
                ('', f'{self._elapsed:.2f} of {self._seconds:.2f} s, {poses} poses')]
