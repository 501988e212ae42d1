"""How far a long task is, shown on a terminal by rich."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
import sys
import time
from typing import Any

from icub_leg_fk.errors import MissingDependencyError
from icub_leg_fk.tools.terminal import import_rich

Progress = Callable[[float], None]  # takes the share that is done, 0 to 1

_PATIENCE = 1.0  # s; a shorter task shows nothing


def part_of(
    progress: Progress | None, shares: list[float], place: int
) -> Progress | None:
    """Return what takes the share of one part of a task, and shows that of all.

    Args:
        progress: shows it; None for nothing.
        shares: those of all parts.
        place: of this part in them.
    """
    if progress is None:
        return None

    def show(share: float) -> None:
        shares[place] = share
        progress(sum(shares) / len(shares))

    return show


@contextmanager
def shown_progress(what: str) -> Iterator[Progress | None]:
    """Give what shows the share of a task that is done, on stderr while the block lasts.

    Gives None where stderr is no terminal that can show it, or rich is not installed.

    Args:
        what: the task in a word or two, such as the name of a recording.
    """
    bar = None
    if sys.stderr is not None and sys.stderr.isatty():
        with suppress(MissingDependencyError):
            bar = _bar()
    if bar is None or not bar.console.is_interactive:
        yield None
        return
    task = bar.add_task(what, total=1.0)
    begin = time.monotonic() + _PATIENCE

    def show(share: float) -> None:
        if time.monotonic() >= begin:
            bar.start()
            bar.update(task, completed=share)

    try:
        yield show
    finally:
        bar.stop()


def _bar() -> Any:
    """Return a bar of rich that leaves nothing on the terminal."""
    rich = import_rich('progress')
    console = rich.console.Console(stderr=True, markup=False, highlight=False)
    name = rich.progress.TextColumn('{task.description}', markup=False)
    share = rich.progress.TextColumn('{task.percentage:3.0f} %', markup=False)
    return rich.progress.Progress(
        name,
        rich.progress.BarColumn(),
        share,
        console=console,
        transient=True,
        redirect_stdout=False,
    )
