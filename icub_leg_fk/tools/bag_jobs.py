"""Converts many bags side by side, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
import time
from typing import NamedTuple

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.bag_conversion import Conversion, convert, OnProgress, Summary
from icub_leg_fk.tools.bag_signals import stop_on_signals

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
    try:
        with stop_on_signals():
            return convert(task.source, task.target, conversion, on_progress)
    except BrokenPipeError:
        raise
    except (LegFKError, OSError) as error:
        return str(error)


def convert_all(tasks: Sequence[Task], conversion: Conversion, jobs: int,
                on_progress: OnProgress,
                on_outcome: Callable[[Task, Outcome], None]) -> None:
    """Convert bags, some at a time.

    Args:
        tasks: the bags.
        conversion: what to do with each.
        jobs: how many at a time.
        on_progress: called now and then with the share that is done.
        on_outcome: called with each task that is over: what has been done, or why not.
    """
    waiting = list(enumerate(tasks))
    running: dict[Connection, tuple[int, Task, BaseProcess]] = {}
    shares = [0.0] * len(tasks)
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                index, task = waiting.pop(0)
                receiver, process = _start(task, conversion)
                running[receiver] = (index, task, process)
            ready = wait(list(running))
            for receiver in [receiver for receiver in running if receiver in ready]:
                index, task, process = running[receiver]
                report = _receive(receiver)
                if isinstance(report, float):
                    shares[index] = report
                else:
                    shares[index] = 1.0
                    del running[receiver]
                    process.join()
                    on_outcome(task, report)
            on_progress(sum(shares) / len(shares))
    finally:
        for _, _, process in running.values():
            process.terminate()
        for _, _, process in running.values():
            process.join()


def _start(task: Task, conversion: Conversion) -> tuple[Connection, BaseProcess]:
    # Not forked: a fork copies the threads of numpy's libraries in whatever state they are.
    context = get_context('spawn')
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(sender, task, conversion))
    process.start()
    sender.close()
    return receiver, process


def _receive(receiver: Connection) -> float | Outcome:
    try:
        report: float | Outcome = receiver.recv()
        return report
    except EOFError:
        return 'the process that worked on it was killed'


def _work(sender: Connection, task: Task, conversion: Conversion) -> None:
    """Convert one bag and report; ends at once if there is nobody left to report to."""
    last = 0.0

    def report(share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _REPORT_PERIOD:
            last = now
            sender.send(share)

    with suppress(KeyboardInterrupt, BrokenPipeError):
        sender.send(convert_one(task, conversion, report))
