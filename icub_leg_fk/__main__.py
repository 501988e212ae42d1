# PYTHON_ARGCOMPLETE_OK
"""The `leg_fk` command, also as `python -m icub_leg_fk`: one subcommand per module of `commands`.

A subcommand's module has `EXAMPLES`, `add_arguments(parser)` and `run(args)`. Only that of the
subcommand asked for is imported.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
import io
import os
import sys

from icub_leg_fk import __version__
from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.tools.command_line import complaint, Parser
from icub_leg_fk.tools.signals import stop_on_signals

COMMANDS = {  # and what they are for
    'list': 'list the chains: versions, joints, tip frames',
    'pose': 'the pose of a foot, or any tip, for one joint vector',
    'explain': 'explain a chain: DH table, each A_i, products, answer',
    'bag': 'copy a bag and add the poses of the feet, as the node sends them',
    'poses': 'the poses of a recording as numbers: CSV, or arrays for numpy',
    'plot': 'a picture of the feet over time and the legs in space, from a bag or CSV',
    'view': 'a page in the browser: sliders, poses, the DH method step by step',
    'table': 'make the DH table of any robot from its URDF, as a kinematics file',
    'compare': 'compare a robot, given by its URDF, with the versions of the tables',
    'urdf': 'write chains as a URDF, for RViz, Pinocchio and others',
    'demo': 'the live demonstration: a walk through the node, poses as they come',
}

DESCRIPTION = """\
Joint angles in, foot poses out: forward kinematics of the iCub's legs, and of any
Denavit-Hartenberg table. Lengths are metres, quaternions x y z w, poses in the root frame."""

EXAMPLES = """\
examples:
  leg_fk list
  leg_fk pose left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk bag walking.mcap walking_with_poses.mcap
  leg_fk poses walking.mcap -o feet.csv
  leg_fk plot walking.mcap -o feet.png
  leg_fk view
  leg_fk table my_robot.urdf --root root_link --tips l_sole r_sole -o my_robot.yaml
  leg_fk compare my_robot.urdf
  leg_fk urdf left_leg right_leg -o legs.urdf
  leg_fk demo

`leg_fk COMMAND -h` explains a command and shows more examples."""

_INTERRUPTED = 128 + 2  # as a shell reports SIGINT
_NOBODY_READS = 128 + 13  # as it reports SIGPIPE


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 2 after a mistake, which is one line on stderr."""
    words = sys.argv[1:] if argv is None else list(argv)
    if sys.stderr is None:  # it is closed, and print would take standard output
        sys.stderr = open(os.devnull, 'w', encoding='utf-8')
    if '_ARGCOMPLETE' in os.environ:
        _complete(os.environ['COMP_LINE'])
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(
            errors='backslashreplace'
        )  # a terminal that is not UTF-8
    try:
        status = _run(words)
        if sys.stdout:
            sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        return _INTERRUPTED
    except BrokenPipeError:
        _forget_output()
        return _NOBODY_READS
    except LegFKError as error:
        _complain(error)
    except OSError as error:
        _complain(error)
        _forget_output()
    return 2


def _run(words: list[str]) -> int:
    try:
        args = parse(words)
        with stop_on_signals():
            return int(args.run(args))
    except SystemExit as done:  # -h and --version, and signals
        return int(done.code or 0)


def parse(words: list[str]) -> argparse.Namespace:
    """Return what the words of the command mean; `run` is what carries it out."""
    command, *rest = words or ['-h']
    if command in COMMANDS:
        parser = Parser(prog=f'leg_fk {command}', description=COMMANDS[command])
        _add_options(parser, command)
        parser.refuse_unknown_options(rest)
        return parser.parse_intermixed_args(rest)  # as in: bag IN --twist OUT
    if not command.startswith('-'):
        raise UnknownNameError('command', command, COMMANDS, 'leg_fk -h explains them')
    parser, _ = _parsers()
    parser.refuse_unknown_options(words)
    return parser.parse_args([command, *rest])


def _parsers() -> tuple[Parser, dict[str, Parser]]:
    """Return the command's parser, and its subcommands', which have no options yet."""
    parser = Parser(
        prog='leg_fk',
        usage='leg_fk COMMAND ...',
        description=DESCRIPTION,
        epilog=EXAMPLES,
    )
    parser.add_argument('--version', action='version', version=f'leg_fk {__version__}')
    subparsers = parser.add_subparsers(
        title='commands', metavar='COMMAND', required=True, prog='leg_fk'
    )
    for name, purpose in COMMANDS.items():
        subparsers.add_parser(name, help=purpose, description=purpose)
    return parser, subparsers.choices


def _add_options(parser: Parser, command: str) -> None:
    module = import_module(f'icub_leg_fk.commands.{command}')
    parser.epilog = module.EXAMPLES
    module.add_arguments(parser)
    parser.set_defaults(run=module.run)


def _complete(line: str) -> None:
    """Offer the shell what may follow, and end the process."""
    from argcomplete import autocomplete  # which has had the shell set the variables

    parser, parsers = _parsers()
    for command in line.split()[1:2]:
        if command in parsers:
            _add_options(parsers[command], command)
    autocomplete(parser)


def _complain(error: Exception) -> None:
    print(f'leg_fk: error: {complaint(error)}', file=sys.stderr)


def _forget_output() -> None:
    """Let what is still buffered go nowhere, so that the interpreter does not complain at exit."""
    if sys.stdout:
        with suppress(OSError):  # not every stdout is a file
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == '__main__':
    sys.exit(main())
