"""`leg_fk demo`: the node in its own process, a walk played to it over DDS, live poses."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.chain_arguments import DEFAULT_VERSION

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from icub_leg_fk.kinematics import Chain
    from icub_leg_fk.tools.demonstration.replay import Answers
    from icub_leg_fk.tools.recording import JointRecording

HELP = 'the live demonstration: a walk played through the node, poses shown as they come'
EXAMPLES = """\
Starts the node foot_pose_publisher in its own process, plays a walking gait, or a recording, to
it as JointState messages over DDS, shows the poses of both feet as they arrive, and at the end
draws them. It talks inside this machine only, in a namespace of its own, and in a ROS_DOMAIN_ID
of its own unless you have set one: no robot is disturbed. Exit status 0 if every pose arrived.

A recording is a CSV file with a column `time` in seconds and one per leg joint, in radians.

examples:
  leg_fk demo
  leg_fk demo --version v1 --seconds 3 -o v1.png
  leg_fk demo --recording walking.csv"""

CHAINS = ('left_leg', 'right_leg')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--recording', metavar='FILE', type=Path,
                        help='CSV file to play, in its own timing (default: a walking gait)')
    parser.add_argument('--version', metavar='VERSION', default=DEFAULT_VERSION,
                        help=f'version of both legs (default: {DEFAULT_VERSION})')
    parser.add_argument('--foot-frame', metavar='{dh,sole}', default='dh',
                        help="axes of the feet: the table's last frame (the default), or the sole")
    parser.add_argument('--seconds', metavar='S', type=_number(0.1, 3600),
                        help='how long to play (default: 10, or the whole recording)')
    parser.add_argument('--rate', metavar='HZ', type=_number(1, 1000),
                        help='messages per second of the gait (default: 100)')
    parser.add_argument('-o', '--output', metavar='FILE', type=Path, default=Path('demo.png'),
                        help='picture to write or replace, .png, .svg or .pdf (default: demo.png)')


def run(args: argparse.Namespace) -> int:
    """Give the demonstration; return 1 if a pose is missing or the node failed."""
    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.tools.demonstration.node import NodeError, stay_on_this_machine
    from icub_leg_fk.tools.demonstration.replay import ReplayError
    from icub_leg_fk.tools.drawing.style import check_output
    from icub_leg_fk.tools.signals import stop_on_signals

    check_output(args.output, force=True)
    catalog = Catalog.load()
    chains = [catalog.chain(name, args.version, args.foot_frame) for name in CHAINS]
    recording = _recording(args, chains)
    domain = stay_on_this_machine()
    print(f'iCub legs {args.version}: {len(recording.times)} JointState messages to '
          f'foot_pose_publisher, poses back over DDS\n'
          f'(this machine only, ROS_DOMAIN_ID {domain}, namespace {_namespace()})\n', flush=True)
    with stop_on_signals():
        try:
            answers = _play(args, recording, chains)
        except (NodeError, ReplayError) as error:
            print(f'leg_fk: error: {error}', file=sys.stderr)
            return 1
        source = args.recording.name if args.recording else 'walking gait'
        _draw(args.output, source, recording, chains, answers)
    return conclude(recording, answers, args.output)


def _recording(args: argparse.Namespace, chains: Sequence[Chain]) -> JointRecording:
    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.tools.gait import walk
    from icub_leg_fk.tools.recording import read_csv

    if args.recording is None:
        return walk(Catalog.load(), args.version, args.seconds or 10.0, args.rate or 100.0)
    if args.rate is not None:
        raise LegFKError('--rate: found with --recording, which is played in its own timing')
    recording = read_csv(args.recording, [name for chain in chains for name in chain.joint_names])
    return recording if args.seconds is None else recording.first(args.seconds)


def _play(args: argparse.Namespace, recording: JointRecording, chains: Sequence[Chain]
          ) -> list[Answers]:
    from icub_leg_fk.tools.demonstration.node import NodeProcess
    from icub_leg_fk.tools.demonstration.replay import DEPTH, Replay
    from icub_leg_fk.tools.demonstration.table import LiveTable

    # What shall not be lost must be reliable, and may wait while the machine does other things.
    joint_states = f'qos_overrides.{_namespace()}/joint_states.subscription'
    parameters = {'version': args.version, 'foot_frame': args.foot_frame,
                  f'{joint_states}.reliability': 'reliable', f'{joint_states}.depth': str(DEPTH)}
    for chain in chains:
        pose = f'{_namespace()}/foot_pose_publisher/{chain.tip}/pose'
        parameters[f'qos_overrides.{pose}.publisher.depth'] = str(DEPTH)
    with Replay(recording, _namespace(), tuple(chain.tip for chain in chains)) as replay, \
            NodeProcess(_namespace(), parameters) as node, \
            LiveTable(replay.answers, recording.times.tolist()) as table:
        replay.wait_for_node(node.check)
        replay.play(table.show, table.period, node.check)
    return replay.answers


def _draw(output: Path, source: str, recording: JointRecording, chains: Sequence[Chain],
          answers: Sequence[Answers]) -> None:
    """Draw what has arrived, if something has of each foot."""
    from icub_leg_fk.tools.drawing.pictures import walk_figure
    from icub_leg_fk.tools.drawing.style import save_picture
    import numpy as np

    tracks = [recording.track(chain) for chain in chains]
    paths = [answer.poses[np.isfinite(answer.latencies)] for answer in answers]
    if not all(map(len, paths)):
        return
    title = f'{source}   {chains[0].version}'
    save_picture(lambda: walk_figure(tracks, paths, title, CHAINS), output)


def conclude(recording: JointRecording, answers: Sequence[Answers], output: Path) -> int:
    """Print the summary; return 0 if each message has exactly one pose per foot."""
    import numpy as np

    sent = len(recording.times)
    arrived = sum(answer.arrived for answer in answers)
    lost = sent * len(answers) - arrived
    unasked = sum(answer.unasked for answer in answers)
    latencies = np.concatenate([answer.latencies for answer in answers]) * 1e3
    latency = 'none' if not arrived else 'median {:.2f} ms   p99 {:.2f} ms   max {:.2f} ms'.format(
        *np.nanpercentile(latencies, (50, 99, 100)))
    duration = recording.times[-1] - recording.times[0]
    print(f'\nmessages in   {sent}  in {duration:.2f} s\n'
          f'poses out     {arrived}  ({", ".join(f"{a.tip} {a.arrived}" for a in answers)})\n'
          f'lost          {lost or "none"}\n'
          f'latency       {latency}\n'
          f'picture       {output if all(a.arrived for a in answers) else "none"}', flush=True)
    if lost or unasked:
        print(f'leg_fk: error: of {sent * len(answers)} poses {lost} did not arrive, and '
              f'{unasked} arrived that belong to no message', file=sys.stderr)
        return 1
    return 0


def _namespace() -> str:
    return f'/leg_fk_demo_{os.getpid()}'


def _number(low: float, high: float) -> Callable[[str], float]:
    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float('nan')
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f'found {text.strip()!r}, allowed: {low:g} to {high:g}')
        return value
    return parse
