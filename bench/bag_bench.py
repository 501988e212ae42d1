"""`leg_fk bag` beside the plain loop over rosbags: time, memory, and two jobs beside one."""

from collections.abc import Sequence
from contextlib import suppress
import os
from pathlib import Path
import shutil
import struct
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import NamedTuple

from bench.joint_messages import joint_positions, ROBOT_JOINTS
from bench.report import ratio, Report, resident_bytes
from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.bags import JOINT_STATE
from icub_leg_fk.tools.recording import write_joint_states
import numpy as np
from rosbags.typesys import get_typestore, Stores

_RATE = 1000  # Hz
_START = 1_700_000_000 * 1_000_000_000  # ns
_GAIT_MESSAGES = 100
_OURS = (sys.executable, '-m', 'icub_leg_fk', 'bag')
_PLAIN = (sys.executable, '-m', 'bench.plain')
_POSES = (sys.executable, '-m', 'icub_leg_fk', 'poses')
_LABELS = {
    'ours': 'leg_fk bag',
    'twists': 'leg_fk bag --twist',
    'plain': 'plain loop over rosbags',
    'poses': 'leg_fk poses to .npz',
}


class _Lengths(NamedTuple):
    short: int  # s, likewise below
    long: int
    jobs: int


class _Run(NamedTuple):
    seconds: float
    peak: float  # MB


def measure_bag(report: Report, quick: bool) -> None:
    """Add speed, memory and two jobs."""
    lengths = _Lengths(1, 1, 1) if quick else _Lengths(10, 90, 120)
    with TemporaryDirectory(prefix='bench_bag_') as directory:
        runs, jobs = _run_all(Path(directory), lengths, rounds=1 if quick else 3)
    seconds = {}
    for name, of_name in runs.items():
        seconds[name] = [run.seconds for run in of_name]
    report.note(
        f'\nleg_fk bag, mcap to mcap, one core, start included: {lengths.long} s at '
        f'{_RATE} Hz, {len(ROBOT_JOINTS)} joints, two feet'
    )
    count = lengths.long * _RATE
    for name, label in _LABELS.items():
        report.row(
            f'{label}, per message', [s / count * 1e6 for s in seconds[name]], 'us'
        )
    report.row('times real time', [lengths.long / s for s in seconds['ours']], 'x')
    report.row(
        'bag, plain loop / here',
        ratio(seconds['plain'], seconds['ours']),
        'x',
        at_least=3.0,
    )
    report.row(
        'bag / poses to .npz',
        ratio(seconds['ours'], seconds['poses']),
        'x',
        at_least=2.0,
    )
    for name, length in (('short', lengths.short), ('ours', lengths.long)):
        peaks = [run.peak for run in runs[name]]
        report.row(f'bag, peak memory, {length} s', peaks, 'MB', at_most=80.0)
    report.row(
        f'bag, two of {lengths.jobs} s, --jobs 1 / --jobs 2',
        ratio(jobs[1], jobs[2]),
        'x',
        at_least=1.6,
    )


def _run_all(
    folder: Path, lengths: _Lengths, rounds: int
) -> tuple[dict[str, list[_Run]], dict[int, list[float]]]:
    """Return the runs of each way, and the seconds that two bags take by number of jobs."""
    long = _write_bag(folder / 'long', lengths.long)
    commands = {
        'ours': [*_OURS, long],
        'plain': [*_PLAIN, long],
        'twists': [*_OURS, '--twist', long],
        'short': [*_OURS, _write_bag(folder / 'short', lengths.short)],
    }
    pair = [_write_bag(folder / name, lengths.jobs) for name in ('one', 'two')]
    runs: dict[str, list[_Run]] = {name: [] for name in (*commands, 'poses')}
    jobs: dict[int, list[float]] = {1: [], 2: []}
    out = folder / 'out'
    for _ in range(rounds):
        for name, command in commands.items():
            runs[name].append(_time(command, out, one_core=True))
        command = [*_POSES, long, '-o']
        runs['poses'].append(_time(command, folder / 'out.npz', one_core=True))
        for count, readings in jobs.items():
            command = [*_OURS, *pair, '--jobs', str(count), '--out-dir']
            readings.append(_time(command, out).seconds)
    return runs, jobs


def _write_bag(path: Path, seconds: int) -> str:
    """Write an mcap bag of JointStates at 1 kHz and return its path."""
    store = get_typestore(Stores.ROS2_JAZZY)
    JointState, Header, Time = (
        store.types[name]
        for name in (JOINT_STATE, 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')
    )
    zeros = np.zeros(len(ROBOT_JOINTS))
    gait = [
        bytes(
            store.serialize_cdr(
                JointState(
                    Header(Time(0, 0), ''),
                    [*ROBOT_JOINTS],
                    np.array(joint_positions(i / _GAIT_MESSAGES)),
                    zeros,
                    zeros,
                ),
                JOINT_STATE,
            )
        )
        for i in range(_GAIT_MESSAGES)
    ]
    stamps = range(_START, _START + seconds * 1_000_000_000, 1_000_000_000 // _RATE)
    write_joint_states(
        path,
        (
            (
                stamp,
                gait[i % _GAIT_MESSAGES][:4]
                + struct.pack('<iI', *divmod(stamp, 1_000_000_000))
                + gait[i % _GAIT_MESSAGES][12:],
            )
            for i, stamp in enumerate(stamps)
        ),
        force=False,
    )
    return str(path)


def _time(command: Sequence[str], output: Path, one_core: bool = False) -> _Run:
    """Run a command that makes `output`, its last argument; remove what it made."""
    cores = os.sched_getaffinity(0)
    if one_core:  # inherited by the process
        os.sched_setaffinity(0, {min(cores)})
    began = time.perf_counter()
    process = subprocess.Popen([*command, str(output)], stdout=subprocess.DEVNULL)
    os.sched_setaffinity(0, cores)
    peak = 0
    while (
        process.poll() is None
    ):  # what wait4 tells is at least the peak of this process
        peak = max(peak, resident_bytes(process.pid, 'VmHWM:'))
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=0.02)
    seconds = time.perf_counter() - began
    if process.returncode:
        raise LegFKError(f'{" ".join(command)} ended with {process.returncode}')
    if output.is_dir():
        shutil.rmtree(output)
    else:
        output.unlink()
    return _Run(seconds, peak / 1e6)
