"""The node as a process of its own, for the demonstration: started, watched and stopped."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
import os
import signal
import subprocess
import sys
import tempfile
from types import TracebackType

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.signals import held_signals

_STOP_TIMEOUT = 10.0  # s
_HIGHEST_DOMAIN = 101  # beyond it DDS's ports meet those that Linux hands out


class NodeError(LegFKError):
    """The node did not start, stopped by itself, or did not stop as asked."""


def stay_on_this_machine() -> str:
    """Set up the environment so that DDS reaches nobody else; return the ROS_DOMAIN_ID.

    A domain that the user has chosen stays.
    """
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_STATIC_PEERS', None)
    return os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % _HIGHEST_DOMAIN))


class NodeProcess:
    """A running `foot_pose_publisher`.

    Args:
        namespace: its namespace.
        parameters: its parameters, by name.
    """

    def __init__(self, namespace: str, parameters: dict[str, str]) -> None:
        words = ['--ros-args', '-r', f'__ns:={namespace}']
        for name, value in parameters.items():
            words += ['-p', f'{name}:={value}']
        self._words: Sequence[str] = (sys.executable, '-m', 'icub_leg_fk.ros.main', *words)
        self._log = tempfile.TemporaryFile()
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> NodeProcess:
        # A session of its own: Ctrl-C reaches the demonstration alone, which then stops the node.
        with held_signals():  # it must not get away between its start and the next line
            self._process = subprocess.Popen(
                self._words, stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log,
                start_new_session=True)
            atexit.register(self._stop)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        with held_signals():
            status = self._stop()
        if kind is None and status != 0:
            raise NodeError(f'the node was stopped by SIGINT and gave exit status {status}, '
                            f'not 0: {self._last_words()}')
        self._log.close()

    def check(self) -> None:
        """Raise the error if the node has stopped by itself."""
        if self._process is not None and (status := self._process.poll()) is not None:
            raise NodeError(f'the node stopped with exit status {status}: {self._last_words()}')

    def _stop(self) -> int:
        process = self._process
        assert process is not None
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        atexit.unregister(self._stop)
        try:
            return process.wait(_STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def _last_words(self) -> str:
        self._log.seek(0)
        lines = self._log.read().decode(errors='replace').split('\n')
        return next((line.strip() for line in reversed(lines) if line.strip()), 'it said nothing')
