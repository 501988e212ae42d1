"""`leg_fk demo`: the node in its own process, a walk played to it over DDS, live poses."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import shutil
import sys
from typing import Any, TYPE_CHECKING

from icub_leg_fk.errors import MissingDependencyError
from icub_leg_fk.tools.chain_arguments import DEFAULT_VERSION, number_between

if TYPE_CHECKING:
    from collections.abc import Sequence

    from icub_leg_fk.kinematics import Catalog, Chain
    from icub_leg_fk.tools.demo_replay import Answers, Replay
    from icub_leg_fk.tools.recording import JointRecording

HELP = 'the live demonstration: a walk played through the node, poses shown as they come'
EXAMPLES = """\
Starts the node foot_pose_publisher in its own process, plays a synthetic walking gait, or a
recording, to it as JointState messages over DDS, shows the poses of both feet as they arrive, and
at the end draws them. It talks inside this machine only, in a namespace of its own, and in a
ROS_DOMAIN_ID of its own unless you have set one: no robot is disturbed. Exit status 0 if every
pose arrived.

A recording is a CSV file with a column `time` in seconds and one per leg joint, in radians.

examples:
  leg_fk demo
  leg_fk demo --save walk        keeps the joint states as a bag, for leg_fk bag and plot
  leg_fk demo --version v1 --seconds 3 -o v1.png
  leg_fk demo --recording walking.csv"""

CHAINS = ('left_leg', 'right_leg')
_INTERRUPTED = 128 + 2  # as a shell reports SIGINT
_COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_COLORS = {'left_foot': '\x1b[38;5;97m', 'right_foot': '\x1b[38;5;172m'}
_FAINT = '\x1b[2m'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--recording', metavar='FILE', type=Path,
                        help='CSV file to play, in its own timing (default: a synthetic gait)')
    parser.add_argument('--version', metavar='VERSION', default=DEFAULT_VERSION,
                        help=f'version of both legs (default: {DEFAULT_VERSION})')
    parser.add_argument('--foot-frame', metavar='{dh,sole}', default='dh',
                        help="axes of the feet: the table's last frame (the default), or the sole")
    parser.add_argument('--seconds', metavar='S', type=number_between(0.1, 3600),
                        help='how long to play (default: the whole recording)')
    parser.add_argument('-o', '--output', metavar='FILE', type=Path,
                        help='picture to write, .png, .svg or .pdf (default: demo.png, which is '
                             'replaced)')
    parser.add_argument('--save', metavar='DIR', type=Path,
                        help='keep the joint states as a rosbag2 bag')
    parser.add_argument('--force', action='store_true',
                        help='replace an existing picture or bag')


def run(args: argparse.Namespace) -> int:
    """Give the demonstration; return 1 if a pose is missing or the node failed."""
    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.tools.demo_replay import DemoError, stay_on_this_machine
    from icub_leg_fk.tools.drawing import check_output
    from icub_leg_fk.tools.output_file import check_target, is_bag
    from icub_leg_fk.tools.signals import stop_on_signals

    picture, force = args.output or Path('demo.png'), args.force or args.output is None
    check_output(picture, force)
    if args.save:
        _rosbags()
        check_target(args.save, force=args.force, may_replace=is_bag)
    catalog = Catalog.load()
    chains = [catalog.chain(name, args.version, args.foot_frame) for name in CHAINS]
    recording = _recording(args, chains)
    domain = stay_on_this_machine()
    print(f'iCub legs {args.version}: {len(recording.times)} JointState messages to '
          f'foot_pose_publisher, poses back over DDS\n'
          f'(this machine only, ROS_DOMAIN_ID {domain}, namespace {_namespace()})\n', flush=True)
    with stop_on_signals():
        try:
            replay, whole = _play(args, recording, chains)
        except DemoError as error:
            print(f'leg_fk: error: {error}', file=sys.stderr)
            return 1
        status = conclude(replay.answers, recording.times[:len(replay.stamps)].tolist(), whole)
        if whole and all(answers.arrived for answers in replay.answers):
            source = args.recording.name if args.recording else 'synthetic gait'
            _draw(picture, force, f'{source}   {args.version}', recording, replay, catalog, chains)
            print(f'picture       {picture}', flush=True)
        if whole and args.save:
            _save(args.save, args.force, recording, replay.stamps)
            print(f'bag           {args.save}', flush=True)
    return status


def _recording(args: argparse.Namespace, chains: Sequence[Chain]) -> JointRecording:
    from icub_leg_fk.kinematics import config_file
    from icub_leg_fk.tools.recording import read_csv

    file = args.recording or config_file('examples/synthetic_walk.csv')
    recording = read_csv(file, [name for chain in chains for name in chain.joint_names])
    return recording if args.seconds is None else recording.first(args.seconds)


def _play(args: argparse.Namespace, recording: JointRecording, chains: Sequence[Chain]
          ) -> tuple[Replay, bool]:
    """Play the recording; return what came of it, and whether it was played to its end."""
    from icub_leg_fk.tools.demo_replay import DEPTH, Replay, running_node

    # What shall not be lost must be reliable, and may wait while the machine does other things.
    joint_states = f'qos_overrides.{_namespace()}/joint_states.subscription'
    parameters = {'version': args.version, 'foot_frame': args.foot_frame,
                  f'{joint_states}.reliability': 'reliable', f'{joint_states}.depth': str(DEPTH)}
    for chain in chains:
        pose = f'{_namespace()}/foot_pose_publisher/{chain.tip}/pose'
        parameters[f'qos_overrides.{pose}.publisher.depth'] = str(DEPTH)
    seconds = float(recording.times[-1] - recording.times[0])
    with Replay(recording, _namespace(), tuple(chain.tip for chain in chains)) as replay, \
            running_node(_namespace(), parameters) as check:
        replay.wait_for_node(check)
        with LiveTable(replay.answers, seconds, chains[0].root_frame) as table:
            try:
                replay.play(table.show, table.period, check)
                return replay, True
            except KeyboardInterrupt:
                return replay, False


def _draw(path: Path, force: bool, title: str, recording: JointRecording, replay: Replay,
          catalog: Catalog, chains: Sequence[Chain]) -> None:
    """Draw what has arrived."""
    from icub_leg_fk.tools.drawing import feet_figure, save_picture
    from icub_leg_fk.tools.plot import default_instants
    from icub_leg_fk.tools.recording import ChainTrack
    import numpy as np

    tracks = []
    for chain, answers in zip(chains, replay.answers):
        track, came = recording.track(chain), np.isfinite(answers.latencies)
        tracks.append(ChainTrack(chain, track.times[came] - recording.times[0],
                                 track.positions[came], answers.poses[came]))
    soles = {chain.name: catalog.chain(chain.name, chain.version, 'sole') for chain in chains}
    save_picture(lambda: feet_figure(tracks, default_instants(tracks), title, soles), path,
                 force=force)


def _save(path: Path, force: bool, recording: JointRecording, stamps: Sequence[int]) -> None:
    """Write the joint states as they were sent, whole or not at all."""
    from icub_leg_fk.tools.output_file import is_bag, whole_path
    import numpy as np

    rosbag2, store = _rosbags()
    kinds = [store.types[name] for name in (
        'sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')]
    joint_state, header, time = kinds
    nothing = np.zeros(0)
    with whole_path(path, force=force, may_replace=is_bag) as place, \
            rosbag2.Writer(place, version=rosbag2.Writer.VERSION_LATEST,
                           storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        topic = writer.add_connection('/joint_states', joint_state.__msgtype__, typestore=store)
        for i, stamp in enumerate(stamps):
            message = joint_state(
                header(time(*divmod(stamp, 1_000_000_000)), ''), list(recording.joint_names),
                recording.positions[i], nothing, nothing)
            writer.write(topic, stamp, store.serialize_cdr(message, joint_state.__msgtype__))


def _rosbags() -> tuple[Any, Any]:
    """Return rosbags' module for bags and its message types."""
    try:
        from rosbags import rosbag2
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise MissingDependencyError(
            "--save needs rosbags: pip install 'rosbags>=0.11.9,<0.12'") from error
    return rosbag2, get_typestore(Stores.ROS2_JAZZY)


def conclude(answers: Sequence[Answers], times: Sequence[float], whole: bool) -> int:
    """Print the summary; return 0 if each message has its poses, 1 if not, 130 after Ctrl-C.

    `times` [s] are those of the messages sent, `whole` tells whether all were.
    """
    import numpy as np

    sent = len(times)
    arrived = sum(answer.arrived for answer in answers)
    lost = sent * len(answers) - arrived
    unexpected = sum(answer.unexpected for answer in answers)
    latencies = np.concatenate([answer.latencies for answer in answers]) * 1e3
    latency = 'none' if not arrived else 'median {:.2f} ms   p99 {:.2f} ms   max {:.2f} ms'.format(
        *np.nanpercentile(latencies, (50, 99, 100)))
    duration = times[-1] - times[0] if sent else 0.0
    missing = (f'lost          {lost or "none"}' if whole
               else f'interrupted   {lost} of the poses had not arrived; no picture, no bag')
    print(f'\nmessages in   {sent}  in {duration:.2f} s\n'
          f'poses out     {arrived}  ({", ".join(f"{a.tip} {a.arrived}" for a in answers)})\n'
          f'{missing}\n'
          f'latency       {latency}', flush=True)
    if not whole:
        return _INTERRUPTED
    if lost or unexpected:
        print(f'leg_fk: error: of {sent * len(answers)} poses {lost} did not arrive, and '
              f'{unexpected} arrived that belong to no message', file=sys.stderr)
        return 1
    return 0


class LiveTable:
    """Shows the newest poses every `period` [s]: on a terminal's second screen, else in lines."""

    def __init__(self, answers: Sequence[Answers], seconds: float, frame: str) -> None:
        self._answers, self._seconds, self._frame = answers, seconds, frame
        self._live = sys.stdout.isatty() and os.environ.get('TERM', 'dumb') != 'dumb'
        self._colored = not os.environ.get('NO_COLOR')
        self._elapsed = 0.0
        self.period = 0.1 if self._live else 1.0

    def __enter__(self) -> LiveTable:
        if self._live:
            self._write('\x1b[?1049h\x1b[?25l')  # the second screen, without a cursor
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._write('\x1b[?25h\x1b[?1049l' + self._line())

    def show(self, elapsed: float) -> None:
        """Show the state at a time since the start [s]."""
        self._elapsed = elapsed
        if not self._live:
            self._write(self._line())
            return
        width, height = shutil.get_terminal_size()
        lines = self._table(width)
        if len(lines) > height:
            lines = [*lines[:max(0, height - 1)], ('', 'more rows: enlarge the terminal')]
        painted = (f'{_COLORS.get(tip, _FAINT)}{line[:width]}\x1b[0m' if self._colored
                   else line[:width] for tip, line in lines)
        self._write('\x1b[H' + '\r\n'.join(f'{line}\x1b[K' for line in painted) + '\x1b[J')

    def _line(self) -> str:
        feet = []
        for answers in self._answers:
            x, y, z = answers.poses[answers.newest, :3]
            feet.append(f'{_words(answers.tip)}: ' + (
                f'x {x:+.4f}  y {y:+.4f}  z {z:+.4f} m' if answers.newest >= 0 else 'no pose yet'))
        return f'{self._elapsed:7.2f} s   in {self._frame}: {"   ".join(feet)}\n'

    def _table(self, width: int) -> list[tuple[str, str]]:
        """Return the lines, as far as they fit, each with the tip it is about."""
        shown = _COLUMNS[:max(0, (width - 13) // 9)]
        lines = [('', f'poses in {self._frame}, in m'),
                 ('', ' ' * 12 + ''.join(f'{name:>9}' for name in shown))]
        for answers in self._answers:
            newest = answers.poses[answers.newest].round(4) + 0.0  # no negative zeros
            numbers = (''.join(f'{value:9.4f}' for value in newest[:len(shown)].tolist())
                       if answers.newest >= 0 else '  no pose yet')
            lines.append((answers.tip, f'{_words(answers.tip):<12}{numbers}'))
        if hidden := len(_COLUMNS) - len(shown):
            lines.append(('', f'{hidden} more columns: widen the terminal'))
        arrived = sum(answers.arrived for answers in self._answers)
        return [*lines, ('', ''), ('', f'{self._elapsed:.2f} of {self._seconds:.2f} s, {arrived} '
                                   'poses')]

    def _write(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()


def _words(name: str) -> str:
    return name.replace('_', ' ')


def _namespace() -> str:
    return f'/leg_fk_demo_{os.getpid()}'
