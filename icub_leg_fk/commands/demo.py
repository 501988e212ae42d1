"""`leg_fk demo`: the node in its own process, a walk played to it over DDS, live poses."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import sys
from typing import Any

from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import Chain, config_file
from icub_leg_fk.stream.configuration import LEGS
from icub_leg_fk.tools import options, text
from icub_leg_fk.tools import recording as recordings
from icub_leg_fk.tools import replay as replays
from icub_leg_fk.tools.bags import import_rosbags
from icub_leg_fk.tools.drawing import check_output, feet_figure, save_picture
from icub_leg_fk.tools.output_file import check_target, is_bag
from icub_leg_fk.tools.recording import JointRecording
from icub_leg_fk.tools.replay import Answers, Replay
from icub_leg_fk.tools.ros import running_ros
from icub_leg_fk.tools.terminal import import_rich
from icub_leg_fk.tools.tracks import ChainTrack, track_of
import numpy as np

EXAMPLES = """\
Starts the node foot_pose_publisher in its own process, plays a synthetic walking gait, or a
recording, to it over DDS, shows the poses of both feet as they arrive, and at the end draws them.
It talks inside this machine only, in its own namespace, and in its own ROS_DOMAIN_ID unless
you have set one: no robot is disturbed. Exit status 0 if every pose arrived. A recording is a bag,
a CSV file with a column of times and one per leg joint in radians, or a log of YARP.

examples:
  leg_fk demo
  leg_fk demo --save walk        keeps the joint states as a bag, for leg_fk bag and plot
  leg_fk demo --version v1 --seconds 3 -o v1.png
  leg_fk demo --recording walking.csv"""

_DEFAULT_PICTURE = 'demo.png'
_COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_WIDTH = len('-0.1234')  # of a cell, whatever the sign
_COLOURS = ('color(97)', 'color(172)')  # of the left and the right foot, as in pictures


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--recording',
        metavar='FILE',
        type=Path,
        help='recording to play, in its own timing (default: a synthetic gait)',
    )
    parser.add_argument(
        '--seconds',
        metavar='S',
        type=options.number_between(0.1, 3600),
        help='how long to play (default: the whole recording)',
    )
    parser.add_argument(
        '--save',
        metavar='DIR',
        type=Path,
        help='keep the joint states as a rosbag2 bag',
    )
    options.add(parser, '--version', '--foot-frame', '--kinematics-file')
    options.add_output(
        parser,
        'picture to write, .png, .svg or .pdf (default: demo.png, which is replaced)',
    )
    parser.set_defaults(chains=LEGS)


def run(args: argparse.Namespace) -> int:
    """Give the demonstration; return 1 if a pose is missing or the node failed."""
    picture = _DEFAULT_PICTURE if args.output is None else args.output
    may_replace = args.force or args.output is None
    check_output(picture, may_replace)
    if args.save:
        import_rosbags()
        check_target(args.save, force=args.force, may_replace=is_bag)
    chains = options.chains_of_one_root(args)
    recording = _recording(args, chains)
    try:
        replay, is_whole = _play(recording, chains, args.kinematics_file)
    except replays.DemoError as error:
        print(f'leg_fk: error: {error}', file=sys.stderr)
        return 1
    status = conclude(
        replay.answers, recording.times[: len(replay.sent)].tolist(), is_whole
    )
    if is_whole and all(answers.arrived for answers in replay.answers):
        tracks = _tracks(recording, chains, replay.answers)
        name = args.recording.name if args.recording else 'synthetic gait'
        title = f'{name}   {chains[0].version}'
        save_picture(
            lambda: feet_figure(tracks, default_instants(tracks), title),
            picture,
            force=may_replace,
        )
        print(f'picture       {picture}', flush=True)
    if is_whole and args.save:
        recordings.write_joint_states(args.save, replay.sent, force=args.force)
        print(f'bag           {args.save}', flush=True)
    return status


def _recording(args: argparse.Namespace, chains: Sequence[Chain]) -> JointRecording:
    file = args.recording or config_file('examples/synthetic_walk.csv')
    recording = recordings.read_joints([file], chains)
    return recording if args.seconds is None else recording.first(args.seconds)


def _play(
    recording: JointRecording, chains: Sequence[Chain], file: str | None
) -> tuple[Replay, bool]:
    """Play the recording to the node; return what came of it, and whether it was whole."""
    domain = replays.stay_on_this_machine()
    namespace = f'/leg_fk_demo_{os.getpid()}'
    print(
        f'iCub legs {chains[0].version}: {len(recording.times)} JointState messages to '
        'foot_pose_publisher, poses back over DDS'
    )
    print(
        f'(this machine only, ROS_DOMAIN_ID {domain}, namespace {namespace})\n',
        flush=True,
    )
    tips = [chain.tip for chain in chains]
    names = [f'{chain.name}={chain.version}' for chain in chains]
    parameters = {'chains': f'[{", ".join(names)}]', 'foot_frame': chains[0].frame}
    if file:
        parameters['kinematics_file'] = os.path.abspath(file)
    parameters |= replays.lossless(namespace, tips, replays.DEPTH)
    seconds = float(recording.times[-1] - recording.times[0])
    with (
        running_ros('the demonstration', 'leg_fk_demo', namespace) as ros,
        replays.running_node(namespace, parameters) as (_, check),
    ):
        replay = Replay(ros, recording, tips)
        display = Display(replay.answers, seconds, chains[0].root_frame)
        replay.wait_for_node(check)
        try:
            with display:
                replay.play(display.show, display.period, check)
        except KeyboardInterrupt:
            return replay, False
    return replay, True


def _tracks(
    recording: JointRecording, chains: Sequence[Chain], answers: Sequence[Answers]
) -> list[ChainTrack]:
    """Return the chains with the poses that have come."""
    tracks = []
    for chain, received in zip(chains, answers, strict=True):
        came = np.isfinite(received.latencies)
        times = recording.times[came]
        positions = recording.positions_of(chain)[came]
        tracks.append(track_of(chain, times, positions, received.poses[came]))
    return tracks


def conclude(answers: Sequence[Answers], times: Sequence[float], is_whole: bool) -> int:
    """Print the summary; return 0 if each message has its poses, 1 if not, 130 after Ctrl-C.

    Args:
        answers: the poses of each tip.
        times: times of the messages sent [s].
        is_whole: whether all were sent.
    """
    sent = len(times)
    seconds = times[-1] - times[0] if sent else 0.0
    arrived = sum(answer.arrived for answer in answers)
    lost = sent * len(answers) - arrived
    of_tips = ', '.join(f'{answer.tip} {answer.arrived}' for answer in answers)
    print(f'\nmessages in   {sent}  in {seconds:.2f} s')
    print(f'poses out     {arrived}  ({of_tips})')
    if is_whole:
        print(f'lost          {lost or "none"}')
    else:
        print(f'interrupted   {lost} of the poses had not arrived; no picture, no bag')
    print(f'latency       {_latency(answers) if arrived else "none"}', flush=True)
    if not is_whole:
        return 128 + 2  # as a shell reports SIGINT
    unexpected = sum(answer.unexpected for answer in answers)
    if lost or unexpected:
        print(
            f'leg_fk: error: of {sent * len(answers)} poses {lost} did not arrive, and '
            f'{unexpected} arrived that belong to no message',
            file=sys.stderr,
        )
        return 1
    return 0


def _latency(answers: Sequence[Answers]) -> str:
    milliseconds = [1000 * answer.latencies for answer in answers]
    median, p99, largest = np.nanpercentile(milliseconds, (50, 99, 100))
    return f'median {median:.2f} ms   p99 {p99:.2f} ms   max {largest:.2f} ms'


class Display:
    """Shows the newest poses every `period` [s]: as a table on a terminal, else as lines.

    Args:
        answers: the poses of the left and of the right foot.
        seconds: how long it will last [s].
        frame: the frame of the poses.
    """

    def __init__(self, answers: Sequence[Answers], seconds: float, frame: str) -> None:
        self._answers = answers
        self._seconds = seconds
        self._frame = frame
        self._elapsed = 0.0
        self._live: Any = None
        if sys.stdout.isatty() and os.environ.get('TERM', 'dumb') != 'dumb':
            self._rich = import_rich('the live table')
            console = self._rich.console.Console(markup=False, highlight=False)
            self._live = self._rich.live.Live(
                console=console,
                screen=True,
                auto_refresh=False,
                redirect_stdout=False,
                redirect_stderr=False,
            )
        self.period = 0.1 if self._live else 1.0

    def __enter__(self) -> Display:
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._live.stop()
            print(self._line(), flush=True)

    def show(self, elapsed: float) -> None:
        """Show the state at a time since the start [s]."""
        self._elapsed = elapsed
        if self._live:
            self._live.update(self._table(), refresh=True)
        else:
            print(self._line(), flush=True)

    def _line(self) -> str:
        feet = []
        for answers in self._answers:
            found = 'no pose yet'
            if answers.arrived:
                x, y, z = answers.poses[answers.newest, :3]
                found = f'x {x:+.4f}  y {y:+.4f}  z {z:+.4f} m'
            feet.append(f'{_name(answers)}: {found}')
        return f'{self._elapsed:7.2f} s   in {self._frame}: {"   ".join(feet)}'

    def _table(self) -> Any:
        Text = self._rich.text.Text
        poses = sum(answers.arrived for answers in self._answers)
        table = self._rich.table.Table(
            box=None,
            title=Text(f'poses in {self._frame}, in m'),
            caption=Text(
                f'{self._elapsed:.2f} of {self._seconds:.2f} s, {poses} poses'
            ),
        )
        table.add_column(no_wrap=True)
        for name in _COLUMNS:
            table.add_column(Text(name), justify='right', no_wrap=True)
        for answers, colour in zip(self._answers, _COLOURS, strict=True):
            cells = [Text(_name(answers)), *map(Text, _cells(answers))]
            table.add_row(*cells, style=colour)
        return table


def _name(answers: Answers) -> str:
    return answers.tip.replace('_', ' ')


def _cells(answers: Answers) -> list[str]:
    if not answers.arrived:
        return ['-'.rjust(_WIDTH)] * len(_COLUMNS)
    newest = answers.poses[answers.newest].tolist()
    return [text.fixed(value, 4).rjust(_WIDTH) for value in newest]
