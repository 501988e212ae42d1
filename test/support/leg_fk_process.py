"""Running the `leg_fk` command as a user does: in a process of its own."""

import os
import subprocess
import sys

COMMAND = [sys.executable, '-m', 'icub_leg_fk']


def leg_fk(*words, environment=None):
    """Run `leg_fk` to its end; return the finished process with its output as text."""
    return subprocess.run([*COMMAND, *map(str, words)], capture_output=True, text=True, timeout=60,
                          env={**os.environ, **(environment or {})})


def assert_one_line_complaint(done, complaint):
    """Check that the command refused: exit 2, one line on stderr that says so, nothing else."""
    assert (done.returncode, done.stdout) == (2, ''), done.stderr
    assert done.stderr.startswith('leg_fk: error: ') and complaint in done.stderr, done.stderr
    assert done.stderr.count('\n') == 1, done.stderr
