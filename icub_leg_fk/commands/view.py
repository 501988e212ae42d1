"""`leg_fk view`: chains in a page of the browser, with sliders, numbers and the DH method."""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
import os
from pathlib import Path
import sys
import webbrowser

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.tools import options
from icub_leg_fk.tools.progress import shown_progress
from icub_leg_fk.tools.tracks import read_tracks
from icub_leg_fk.tools.viewer import Source, Viewer
from icub_leg_fk.tools.viewer_live import DEFAULT_TOPIC, live_joints
from icub_leg_fk.tools.viewer_page import running_server
from icub_leg_fk.tools.viewer_recording import RecordedChain, Recording
from icub_leg_fk.tools.viewer_scene import axis_names

EXAMPLES = """\
A slider per joint moves the chains; a click on a pose selects it, to be copied. The tab Method
shows the Denavit-Hartenberg method step by step, as `leg_fk explain` prints it. The page can be
reached from this machine only, unless --host says otherwise. Ctrl-C ends it.

examples:
  leg_fk view
  leg_fk view left_leg=v1 --foot-frame sole
  leg_fk view arm -k my_robot.yaml
  leg_fk view --recording walking.csv
  leg_fk view --live"""

_HIGHEST_PORT = 64535  # viser tries the next thousand, too
_EVERY_ADDRESS = ('0.0.0.0', '::')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        'chains',
        metavar='CHAIN',
        nargs='*',
        help='chains, such as left_leg or head_imu=v2 (default: both legs)',
    )
    options.add(parser, '--version', '--foot-frame', '--kinematics-file')
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        '--recording',
        metavar='FILE',
        type=Path,
        help='play a bag, a CSV file or a log of YARP',
    )
    source.add_argument(
        '--live',
        action='store_true',
        help='follow the joint states of a running robot (needs ROS 2)',
    )
    parser.add_argument(
        '--joint-topic',
        metavar='TOPIC',
        help="topic of joint states: the recording's (default: /joint_states, or "
        f"the only one there is) or the robot's (default: {DEFAULT_TOPIC})",
    )
    parser.add_argument(
        '--host',
        metavar='ADDRESS',
        default='127.0.0.1',
        help='address to listen at (default: 127.0.0.1, this machine only)',
    )
    parser.add_argument(
        '--port',
        metavar='PORT',
        default=8080,
        type=_port,
        help='port to listen at, or the next one that is free (default: 8080)',
    )
    parser.add_argument(
        '--no-browser', action='store_true', help='only print the address of the page'
    )


def run(args: argparse.Namespace) -> int:
    """Show the page until a signal ends it."""
    if args.joint_topic is not None and not (args.recording or args.live):
        raise LegFKError('--joint-topic goes with --recording or --live')
    chains = options.chains_of_one_root(args)
    with ExitStack() as stack:
        server = stack.enter_context(running_server(args.host, args.port))
        source: Source | None = None
        if args.recording:
            chains, source = _recording(args.recording, chains, args.joint_topic)
        elif args.live:
            topic = args.joint_topic or DEFAULT_TOPIC
            source = stack.enter_context(live_joints(chains, topic))
        viewer = Viewer(server, chains, source)
        _announce(chains, args, server.get_port())
        viewer.run()
    return 0


def _recording(
    path: Path, chains: Sequence[Chain], topic: str | None
) -> tuple[list[Chain], Recording]:
    """Return the chains that a recording moves, and the recording."""
    topics = [] if topic is None else [topic]
    with shown_progress(path.name) as progress:
        reading = read_tracks([path], chains, topics, progress)
    options.print_notes(reading.warnings, reading.notes)
    recorded = [
        RecordedChain(track.chain, track.times, track.positions)
        for track in reading.tracks
    ]
    return [track.chain for track in reading.tracks], Recording(recorded)


def _announce(chains: Sequence[Chain], args: argparse.Namespace, port: int) -> None:
    """Print where the page is, and open it in the browser."""
    if args.port not in (0, port):
        print(
            f'leg_fk: note: port {args.port} is taken, port {port} is not',
            file=sys.stderr,
        )
    host = f'[{args.host}]' if ':' in args.host else args.host
    if args.host in _EVERY_ADDRESS:
        host = '127.0.0.1'
    address = f'http://{host}:{port}/'
    names = ', '.join(f'{chain.name}={chain.version}' for chain in chains)
    root = chains[0]
    where = f' ({", ".join(axis_names(root))})' if root.root_axes else ''
    print(
        f'{names} in {root.root_frame}{where}\n{address}   (Ctrl-C ends it)', flush=True
    )
    if not args.no_browser and _has_display():
        webbrowser.open(address)


def _has_display() -> bool:
    """Tell whether a browser has a window; one in the terminal would be of no use."""
    if not sys.platform.startswith('linux'):
        return True
    return any(os.environ.get(name) for name in ('DISPLAY', 'WAYLAND_DISPLAY'))


def _port(words: str) -> int:
    value = options.number(words)
    if value not in range(_HIGHEST_PORT + 1):
        raise argparse.ArgumentTypeError(
            f'found {words.strip()!r}, allowed: 1 to {_HIGHEST_PORT},'
            ' or 0 for any that is free'
        )
    return int(value)
