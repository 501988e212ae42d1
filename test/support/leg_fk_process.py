"""Running the `leg_fk` command: in a process of its own, as a user does, or in this one."""

from contextlib import redirect_stderr, redirect_stdout
import io
import os
import subprocess
import sys

from icub_leg_fk.__main__ import main

COMMAND = [sys.executable, '-m', 'icub_leg_fk']


def leg_fk(*words, environment=None, stdout=subprocess.PIPE):
    """Run `leg_fk` to its end; return the finished process with its output as text."""
    return subprocess.run(
        [*COMMAND, *map(str, words)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
        env={**os.environ, **(environment or {})},
    )


def run_code(code, *words, environment=None):
    """Run Python code with some arguments; return the finished process."""
    return subprocess.run(
        [sys.executable, '-c', code, *map(str, words)],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, **(environment or {})},
    )


def peak_of(*words, environment=None):
    """Run `leg_fk` in a process of its own; return the peak of its resident size [MB]."""
    code = (
        'import sys; from icub_leg_fk.__main__ import main; status = main(); '
        'peak, = (line for line in open("/proc/self/status") if line.startswith("VmHWM")); '
        'print(peak.split()[1], file=sys.stderr); sys.exit(status)'
    )
    done = run_code(code, *words, environment=environment)
    assert done.returncode == 0, done
    return int(done.stderr.split()[-1]) / 1000


def run_main(*words):
    """Run `leg_fk` in this process; return what it would leave as a process of its own."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main([str(word) for word in words])
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def assert_one_line_complaint(done, complaint):
    """Check that the command refused: exit 2, one line on stderr that says so, nothing else."""
    assert (done.returncode, done.stdout) == (2, ''), done.stderr
    assert done.stderr.startswith('leg_fk: error: ') and complaint in done.stderr, (
        done.stderr
    )
    assert done.stderr.count('\n') == 1, done.stderr
