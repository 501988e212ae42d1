"""The command line and the parameter files, read once more for what rclpy does not say.

rclpy hands over parameters without a word on where they came from, takes `version:=v1` for a
remapping, and passes over a file that is for other nodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
import re
from typing import Any, NamedTuple

from icub_leg_fk.errors import closest, InputFileError, LegFKError
from icub_leg_fk.kinematics.kinematics_file import listed
import yaml

_PARAMETER = ('-p', '--param')
_REMAPPING = ('-r', '--remap')
_FILE = '--params-file'
_WITH_VALUE = (
    *_PARAMETER,
    *_REMAPPING,
    _FILE,
    '-e',
    '--enclave',
    '--log-level',
    '--log-config-file',
    '--log-file-name',
)
_TOKENS = {'*': '/[^/]+', '**': '(/[^/]+)*'}


class Argument(NamedTuple):
    """A word of the command line.

    Attributes:
        option: the option whose value it is, such as `-p`; empty if it is none's.
        word: the word.
    """

    option: str
    word: str


def read_arguments(argv: Sequence[str]) -> list[Argument]:
    """Return the words of a command line but for its first and the options that take a value."""
    arguments = []
    option = ''
    is_ros = False
    for word in argv[1:]:
        if option:
            arguments.append(Argument(option, word))
            option = ''
        elif word in ('--ros-args', '--'):
            is_ros = word == '--ros-args'
        elif is_ros and word in _WITH_VALUE:
            option = word
        else:
            arguments.append(Argument('', word))
    return arguments


def check_assignments(arguments: Iterable[Argument], parameters: Sequence[str]) -> None:
    """Refuse what is meant to set something, but is not written as `--ros-args -p NAME:=VALUE`.

    Args:
        arguments: the words of the command line.
        parameters: names of the node's parameters.

    Raises:
        LegFKError: says how to write it.
    """
    for option, word in arguments:
        name, assigns, value = word.partition(':=')
        last_name = name.rpartition(':')[2]
        if option in _PARAMETER and not assigns:
            name, _, value = word.partition('=')
            raise _misplaced(f'{option} {word}', f'-p {name}:={value or "VALUE"}')
        if option in _REMAPPING and last_name in parameters:
            raise _misplaced(f'{option} {word}', f'-p {last_name}:={value}')
        if not option and assigns:
            raise _misplaced(word, f'--ros-args {_meant(name, parameters)}:={value}')


def _meant(name: str, parameters: Sequence[str]) -> str:
    """Return what a bare name is most likely meant to set: a parameter, or a topic's name."""
    parameter = closest(name.removeprefix('_'), parameters)
    return f'-p {parameter}' if parameter else f'-r {name}'


def _misplaced(found: str, meant: str) -> LegFKError:
    return LegFKError(f'unknown argument {found!r}; did you mean {meant}?')


def names_given(arguments: Iterable[Argument], node: str) -> set[str]:
    """Return the names of the parameters that the command line gives to a node.

    Args:
        arguments: the words of the command line.
        node: full name of the node.
    """
    names = set()
    for option, word in arguments:
        if option in _PARAMETER:
            place, _, name = word.partition(':=')[0].rpartition(':')
            if not place or _is_for(place, node):
                names.add(name)
    return names


def files_for_others(arguments: Iterable[Argument], node: str) -> list[str]:
    """Return a line on each parameter file of the command line that has nothing for a node."""
    lines = []
    for file in [word for option, word in arguments if option == _FILE]:
        try:
            places = [place for place, _ in _sections(file)]
        except InputFileError:  # rcl has read it, which is what counts
            continue
        if places and not any(_is_for(place, node) for place in places):
            lines.append(
                f'nothing was taken from {file}: it is for {listed(places)}, and this '
                f'node is {node}'
            )
    return lines


def parameters_for(file: str, node: str) -> dict[str, Any]:
    """Return what a parameter file holds for a node, by name.

    Args:
        file: path of the file.
        node: full name of the node.

    Raises:
        InputFileError: the file cannot be read.
    """
    parameters: dict[str, Any] = {}
    for place, section in _sections(file):
        if _is_for(place, node) and isinstance(section, dict):
            parameters |= section
    return parameters


def _sections(file: str) -> list[tuple[str, object]]:
    """Return the node names of a parameter file, patterns as they may be, with what is theirs."""
    try:
        with open(file, encoding='utf-8') as stream:
            return list(_sections_of(yaml.safe_load(stream)))
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        raise InputFileError(file, ' '.join(str(error).split())) from error


def _sections_of(content: object, place: str = '') -> Iterator[tuple[str, object]]:
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        if key == 'ros__parameters':
            yield place, value
        else:
            yield from _sections_of(value, f'{place}/{str(key).strip("/")}')


def _is_for(pattern: str, node: str) -> bool:
    """Return whether a node name of a parameter file stands for a node of this full name."""
    tokens = pattern.strip('/').split('/')
    expression = ''.join(_TOKENS.get(token, '/' + re.escape(token)) for token in tokens)
    return re.fullmatch(expression, node) is not None
