"""Converts many bags side by side, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import gc
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
import time
from typing import NamedTuple

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.bags.conversion import Conversion, convert, OnProgress, Summary
from icub_leg_fk.tools.signals import stop_on_signals

_REPORT_PERIOD = 0.1  # s

Outcome = Summary | str
"""What has been done, or in one line why nothing has."""


class Task(NamedTuple):
    """A bag to read and the bag to make of it."""

    source: Path
    target: Path


def convert_one(task: Task, conversion: Conversion, on_progress: OnProgress) -> Outcome:
    """Convert a bag.

    Args:
        task: the bag.
        conversion: what to do with it.
        on_progress: called now and then.
    """
    gc.disable()  # it would look through every block in vain: there are no cycles
    try:
        with stop_on_signals():
            return convert(task.source, task.target, conversion, on_progress)
    except (BrokenPipeError, ConnectionResetError):  # not of the bags, but of who waits for them
        raise
    except (LegFKError, OSError) as error:
        return str(error)
    finally:
        gc.enable()


def convert_all(tasks: Sequence[Task], conversion: Conversion, jobs: int,
                on_progress: OnProgress, on_outcome: Callable[[Task, Outcome], None]) -> None:
    """Convert bags, some at a time.

    Args:
        tasks: the bags.
        conversion: what to do with each.
        jobs: how many at a time.
        on_progress: called now and then with the share that is done.
        on_outcome: called with each task that is over: what has been done, or why not.
    """
    waiting = list(enumerate(tasks))
    shares = [0.0] * len(tasks)
    working: dict[Connection, tuple[_Worker, int]] = {}
    idle: list[_Worker] = []
    try:
        while waiting or working:
            while waiting and len(working) < jobs:
                worker = idle.pop() if idle else _Worker(conversion, list(working))
                index, task = waiting.pop(0)
                worker.pipe.send(task)
                working[worker.pipe] = worker, index
            ready = wait(list(working))
            for pipe in [pipe for pipe in working if pipe in ready]:
                worker, index = working[pipe]
                report = worker.report()
                shares[index] = report if isinstance(report, float) else 1.0
                if not isinstance(report, float):
                    del working[pipe]
                    if worker.process.is_alive():
                        idle.append(worker)
                    on_outcome(tasks[index], report)
            on_progress(sum(shares) / len(shares))
    finally:
        everyone = [*idle, *(worker for worker, _ in working.values())]
        for worker in everyone:
            worker.process.terminate()
        for worker in everyone:
            worker.process.join()


class _Worker:
    """A process that converts one bag after another.

    Args:
        conversion: what to do with each.
        others: the pipes of the other workers.

    Attributes:
        pipe: takes tasks.
        process: the process.
    """

    def __init__(self, conversion: Conversion, others: Sequence[Connection]) -> None:
        # Forked, since a new interpreter takes as long to start as half a minute of recording to
        # convert. No thread of Python's runs here, and numpy's BLAS sets itself up anew.
        context = get_context('fork')
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(
            target=_work, args=(theirs, conversion, [self.pipe, *others]), daemon=True)
        self.process.start()
        theirs.close()

    def report(self) -> float | Outcome:
        """Return what the process reports next: the share that is done, or how a task went."""
        try:
            report: float | Outcome = self.pipe.recv()
            return report
        except (EOFError, ConnectionResetError):
            self.process.join()
            return 'the process that worked on it was killed'


def _work(pipe: Connection, conversion: Conversion, inherited: Sequence[Connection]) -> None:
    """Convert bags and report; ends at once if there is nobody left to report to."""
    for end in inherited:  # an open copy here would hide that the parent has gone
        end.close()
    last = 0.0

    def report(share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _REPORT_PERIOD:
            last = now
            pipe.send(share)

    with suppress(KeyboardInterrupt, EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            pipe.send(convert_one(pipe.recv(), conversion, report))
