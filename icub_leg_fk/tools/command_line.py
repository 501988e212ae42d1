"""The parser of `leg_fk` and its subcommands: argparse, with negative numbers and good advice.

The private members of argparse that cannot be avoided stand here alone; Python 3.10 to 3.13 have
them.
"""

import argparse
from collections.abc import Iterable, Sequence
from itertools import takewhile
import re
from typing import Any, NoReturn

from icub_leg_fk.errors import closest, LegFKError, ParameterError

# Python 3.14 takes the same, infinity and NaN apart; older ones take -1e-3 for an option.
_NEGATIVE_NUMBER = re.compile(r'-(\.?\d|inf|nan)', re.IGNORECASE)


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Shows a usage line that works as typed: options, which may take many words, come last."""

    def add_usage(
        self,
        usage: str | None,
        actions: Iterable[argparse.Action],
        groups: Iterable[Any],
        prefix: str | None = None,
    ) -> None:
        """Add the usage line: arguments, what must be given, and a word for the options."""
        super().add_usage(usage or _usage(list(actions), groups), (), (), prefix)


class Parser(argparse.ArgumentParser):
    """An argument parser that takes every negative number and complains in one line."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(formatter_class=HelpFormatter, allow_abbrev=False, **settings)
        self._negative_number_matcher = _NEGATIVE_NUMBER

    def error(self, message: str) -> NoReturn:
        """Raise the mistake, for `main` to report."""
        raise LegFKError(f'{message} (see {self.prog} -h)')

    def refuse_unknown_options(self, words: Sequence[str]) -> None:
        """Name an option that does not exist; argparse would miss a required one instead."""
        for word in takewhile('--'.__ne__, words):
            option = word.partition('=')[0]
            if self._is_known(option) or _NEGATIVE_NUMBER.match(option):
                continue
            guess = closest(option, self._option_string_actions)
            question = f'; did you mean {guess}?' if guess else ''
            self.error(f'unknown option {option}{question}')

    def _is_known(self, option: str) -> bool:
        """Return whether a word is an option, or one letter of it and a value, or neither."""
        if not option.startswith('-') or option == '-':
            return True
        known = self._option_string_actions
        return option in known or (option[1] != '-' and option[:2] in known)


def complaint(error: Exception) -> str:
    """Return an error as a line, in which a parameter is named as the option that sets it."""
    line = str(error)
    if isinstance(error, ParameterError):
        line = f'--{error.parameter.replace("_", "-")}: {error.fault}'
    return ' '.join(line.split())


def _usage(actions: Sequence[argparse.Action], groups: Iterable[Any]) -> str:
    words = ['%(prog)s']
    words += [_argument(action) for action in actions if not action.option_strings]
    words += [
        _option(action)
        for action in actions
        if action.option_strings and action.required
    ]
    for group in groups:
        if group.required:
            choices = [_option(action) for action in group._group_actions]
            words.append(f'({" | ".join(choices)})')
    return ' '.join([*words, '[options]'])


def _option(action: argparse.Action) -> str:
    return f'{action.option_strings[-1]} {_argument(action)}'


def _argument(action: argparse.Action) -> str:
    """Return how the words of an argument, or of an option's value, are typed."""
    word = str(action.metavar)
    typed = {'*': f'[{word} ...]', '+': f'{word} ...', '?': f'[{word}]'}
    return typed.get(str(action.nargs), word)
