"""`leg_fk view`: chains in a page of the browser, with sliders, numbers and the DH method."""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
import os
from pathlib import Path
import sys
import webbrowser

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, Urdf
from icub_leg_fk.tools import options
from icub_leg_fk.tools.progress import shown_progress
from icub_leg_fk.tools.recorded_robot import recorded_chains, refuse_second_source
from icub_leg_fk.tools.tracks import read_tracks
from icub_leg_fk.tools.viewer import Viewer
from icub_leg_fk.tools.viewer_live import following, LiveRobot
from icub_leg_fk.tools.viewer_page import running_server
from icub_leg_fk.tools.viewer_recording import Recording
from icub_leg_fk.tools.viewer_scene import root_words
from icub_leg_fk.tools.viewer_source import Source

EXAMPLES = """\
A slider per joint moves the chains; a click on a pose selects it, to be copied. The tab Method
shows the Denavit-Hartenberg method step by step, as `leg_fk explain` prints it. The page can be
reached from this machine only, unless --host says otherwise. Ctrl-C ends it.

examples:
  leg_fk view
  leg_fk view left_leg=v1 --foot-frame sole
  leg_fk view arm -k my_robot.yaml
  leg_fk view --recording walking.csv
  leg_fk view head_imu --recording dump/torso dump/head
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
    options.add(parser, '--version', '--foot-frame', '--kinematics-file', '--root')
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        '--recording',
        metavar='FILE',
        nargs='+',
        type=options.path,
        help='play bags, CSV files or logs of YARP; several are parts of one robot',
    )
    source.add_argument(
        '--live',
        action='store_true',
        help='follow the joint states of a running robot, and its description unless '
        '-k or a version is given (needs ROS 2)',
    )
    options.add(
        parser,
        '--joint-topic',
        '--joint-prefix',
        '--description-from-topic',
        '--time-unit',
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
    _refuse_topics(args)
    with ExitStack() as stack:
        server = stack.enter_context(running_server(args.host, args.port))
        source: Source | None = None
        if args.recording:
            source = _recording(args)
        elif args.live:
            source = stack.enter_context(following(_robot(args)))
        chains = source.chains if source else options.chains_of_one_root(args)
        viewer = Viewer(server, chains, source)
        _announce(chains, args, server.get_port())
        viewer.run()
    return 0


def _refuse_topics(args: argparse.Namespace) -> None:
    """Refuse topics where there are none."""
    if args.recording or args.live:
        return
    for option in ('joint_topics', 'description_from_topic'):
        if getattr(args, option):
            words = option.rstrip('s').replace('_', '-')
            raise LegFKError(f'--{words} goes with --recording or --live')


def _recording(args: argparse.Namespace) -> Recording:
    """Return the recording, with the chains that it moves."""
    chains = recorded_chains(args)
    with shown_progress(Path(args.recording[0]).name) as progress:
        reading = read_tracks(
            args.recording,
            chains,
            args.joint_topics,
            progress,
            time_unit=args.time_unit,
            joint_prefix=args.joint_prefix,
        )
    options.print_notes(reading.warnings, reading.notes)
    return Recording(reading.tracks)


def _robot(args: argparse.Namespace) -> LiveRobot:
    """Return the robot; a table that is asked for is not replaced by a description."""

    def select(urdf: Urdf) -> list[Chain]:
        catalog = Catalog.from_urdf(urdf, root=args.root)
        options.print_notes(catalog.warnings, [])
        return options.chains_of(catalog, args)

    topic = args.description_from_topic
    if topic:
        refuse_second_source(args.kinematics_file)
    chains = options.chains_of_one_root(args)
    is_table = args.kinematics_file or args.version or '=' in ' '.join(args.chains)
    return LiveRobot(
        chains,
        args.joint_topics,
        None if is_table else select,
        topic if isinstance(topic, str) else '',
    )


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
    print(f'{names} in {root_words(chains[0])}')
    print(f'{address}   (Ctrl-C ends it)', flush=True)
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
