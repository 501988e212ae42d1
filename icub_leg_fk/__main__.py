# PYTHON_ARGCOMPLETE_OK
"""The `leg_fk` command, also as `python -m icub_leg_fk`: one subcommand per module of `commands`.

A subcommand's module has `EXAMPLES`, `add_arguments(parser)` and `run(args)`. Only that of the
subcommand asked for is imported; what is optional it imports inside functions, and `pose`, which
is asked for most, numpy too.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
import io
from itertools import takewhile
import os
import re
import sys
from typing import Any, NoReturn

from icub_leg_fk import __version__
from icub_leg_fk.errors import closest, LegFKError, UnknownNameError
from icub_leg_fk.tools.signals import stop_on_signals

COMMANDS = {  # and what they are for
    'list': 'list the chains: versions, joints, tip frames',
    'pose': 'the pose of a foot, or any tip, for one joint vector',
    'explain': 'explain a chain: DH table, each A_i, products, answer',
    'bag': 'copy a bag and add the poses of the feet, as the node sends them',
    'plot': 'a picture of the feet over time and the legs in space, from a bag or CSV',
    'view': 'a page in the browser: sliders, poses, the DH method step by step',
    'table': 'make the DH table of any robot from its URDF, as a kinematics file',
    'compare': 'compare a robot, given by its URDF, with the versions of the tables',
    'urdf': 'write chains as a URDF, for RViz, Pinocchio and others',
    'demo': 'the live demonstration: a walk through the node, poses as they come'}

DESCRIPTION = """\
Joint angles in, foot poses out: forward kinematics of the iCub's legs, and of any
Denavit-Hartenberg table. Lengths are metres, quaternions x y z w, poses in the root frame."""

EXAMPLES = """\
examples:
  leg_fk list
  leg_fk pose left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk bag walking.mcap walking_with_poses.mcap
  leg_fk plot walking.mcap -o feet.png
  leg_fk table my_robot.urdf --root root_link --tips l_sole r_sole -o my_robot.yaml
  leg_fk compare my_robot.urdf
  leg_fk urdf left_leg right_leg -o legs.urdf
  leg_fk demo

`leg_fk COMMAND -h` explains a command and shows more examples."""

_NEGATIVE = re.compile(r'-(inf|nan|(\d+\.?\d*|\.\d+)(e[-+]?\d+)?)(,|$)', re.IGNORECASE)


class Parser(argparse.ArgumentParser):
    """An argument parser that takes every negative number and complains in one line."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter,
                         allow_abbrev=False, **settings)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the arguments; `-1e-3` is a value, which argparse alone takes for an option."""
        # A word that starts with a space is never an option, and float() ignores the space.
        args = [f' {word}' if _NEGATIVE.match(word) else word for word in args or ()]
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Raise the mistake, for `main` to report."""
        raise LegFKError(f'{message} (see {self.prog} -h)')

    def refuse_unknown_options(self, words: Sequence[str]) -> None:
        """Name an option that does not exist; argparse would miss a required one instead."""
        known = self._option_string_actions
        for word in takewhile('--'.__ne__, words):
            option = word.partition('=')[0]
            if (not word.startswith('-') or word == '-' or _NEGATIVE.match(word) or option in known
                    or (word[:2] in known and not word.startswith('--'))):
                continue
            guess = closest(option, known) or next((name for name in known if name[:2] == '--'
                                                 and len(option) > 3 and option[2:] in name), '')
            self.error(f'unknown option {option}{f"; did you mean {guess}?" if guess else ""}')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 2 after a mistake, which is told in one line on stderr."""
    words = sys.argv[1:] if argv is None else list(argv)
    if '_ARGCOMPLETE' in os.environ:
        from argcomplete import autocomplete  # which set these variables
        autocomplete(_parsers(os.environ['COMP_LINE'].split()[1:])[0])
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors='backslashreplace')  # a terminal that is not UTF-8
    try:
        status = _run(words)
        if sys.stdout:
            sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        return 128 + 2  # as a shell reports SIGINT
    except BrokenPipeError:
        _forget_output()
        return 128 + 13  # as it does SIGPIPE
    except (LegFKError, OSError) as error:
        print(f'leg_fk: error: {" ".join(str(error).split())}', file=sys.stderr)
        if isinstance(error, OSError):
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
    """Return what the words of the command say; `run` is what carries it out."""
    parser, parsers = _parsers(words)
    if words and words[0] in parsers:
        parsers[words[0]].refuse_unknown_options(words[1:])
        return parsers[words[0]].parse_intermixed_args(words[1:])  # as in: bag IN --twist OUT
    if words and not words[0].startswith('-'):
        raise UnknownNameError('command', words[0], COMMANDS)
    return parser.parse_args(words or ['-h'])


def _parsers(words: Sequence[str]) -> tuple[Parser, dict[str, Parser]]:
    """Return the command's parser, and its subcommands'; only the one asked for has options."""
    parser = Parser(prog='leg_fk', description=DESCRIPTION, epilog=EXAMPLES)
    parser.add_argument('--version', action='version', version=f'leg_fk {__version__}')
    subparsers = parser.add_subparsers(title='commands', metavar='COMMAND', required=True,
                                       prog='leg_fk')  # argparse would import much to find it
    for name, purpose in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=purpose, description=purpose)
        if name in words[:1]:
            module = import_module(f'icub_leg_fk.commands.{name}')
            subparser.epilog = module.EXAMPLES
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
    return parser, subparsers.choices


def _forget_output() -> None:
    """Let what is still buffered go nowhere, so that the interpreter does not complain at exit."""
    if sys.stdout:
        with suppress(OSError):  # not every stdout is a file
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == '__main__':
    sys.exit(main())
