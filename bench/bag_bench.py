"""Point 6 and half of point 7: `leg_fk bag` beside the plain loop over rosbags."""

from __future__ import annotations

from collections.abc import Sequence
import os
from pathlib import Path
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import NamedTuple

from bench.joint_messages import joint_names, joint_positions
from bench.measure import figure, peak_resident_bytes, ratio
from bench.report import Report

_JOINTS = 32
_RATE = 1000  # Hz
_START = 1_700_000_000 * 1_000_000_000  # ns
_GAIT_MESSAGES = 100
_LENGTHS = (10, 30, 60)  # s
_JOBS_LENGTH = 180  # s
_OURS = (sys.executable, '-m', 'icub_leg_fk.tools.leg_fk', 'bag')
_PLAIN = (sys.executable, '-m', 'bench.plain_bag')


class _Run(NamedTuple):
    seconds: float
    peak: float  # MB


def measure_bag(report: Report, quick: bool) -> None:
    """Add the rows of point 6, and time against length to the picture."""
    lengths, jobs_length, rounds = ((1, 2), 2, 1) if quick else (_LENGTHS, _JOBS_LENGTH, 3)
    ours: dict[int, list[_Run]] = {seconds: [] for seconds in lengths}
    plain: dict[int, list[_Run]] = {seconds: [] for seconds in lengths}
    with TemporaryDirectory(prefix='bench_bag_') as directory:
        folder = Path(directory)
        bags = {seconds: write_bag(folder / f'{seconds}_s', seconds) for seconds in lengths}
        for _ in range(rounds):
            for seconds, bag in bags.items():
                ours[seconds].append(_time([*_OURS, str(bag)], folder / 'out', one_core=True))
                plain[seconds].append(_time([*_PLAIN, str(bag)], folder / 'out', one_core=True))
        longest = str(bags[lengths[-1]])
        twists = [_time([*_OURS, '--twist', longest], folder / 'out', one_core=True)
                  for _ in range(rounds)]
        jobs = _time_jobs(folder, jobs_length, rounds)
    _report_speed(report, ours, plain, twists)
    report.row(f'two bags of {jobs_length} s, --jobs 1 / --jobs 2', ratio(jobs[1], jobs[2]), 'x',
               at_least=1.7)
    _report_memory(report, ours)
    for name, runs in (('ours', ours), ('plain', plain)):
        for length, of_length in runs.items():
            report.grow('bag', name, length, figure([run.seconds for run in of_length]))


def _time_jobs(folder: Path, seconds: int, rounds: int) -> dict[int, list[float]]:
    """Return how long two bags take with one and with two jobs [s]."""
    bag, twin = write_bag(folder / 'bag', seconds), folder / 'twin'
    shutil.copytree(bag, twin)
    taken: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(rounds):
        for jobs, readings in taken.items():
            readings.append(_time([*_OURS, str(bag), str(twin), '--jobs', str(jobs), '--out-dir'],
                                  folder / 'out').seconds)
    return taken


def _report_speed(report: Report, ours: dict[int, list[_Run]], plain: dict[int, list[_Run]],
                  twists: list[_Run]) -> None:
    longest = max(ours)
    messages = longest * _RATE
    seconds = {name: [run.seconds for run in runs] for name, runs in (
        ('ours', ours[longest]), ('plain', plain[longest]), ('twists', twists))}
    report.section(f'6. leg_fk bag, mcap to mcap, one core, start included: {longest} s at '
                   f'{_RATE} Hz, {_JOINTS} joints, two feet')
    for name, label in (('ours', 'leg_fk bag'), ('twists', 'leg_fk bag --twist'),
                        ('plain', 'plain loop')):
        report.row(f'{label}, per message', figure([s / messages * 1e6 for s in seconds[name]]),
                   'us')
    report.row('plain / leg_fk bag', ratio(seconds['plain'], seconds['ours']), 'x', at_least=8.0)
    report.row('times real time', figure([longest / s for s in seconds['ours']]), 'x',
               at_least=60.0)


def _report_memory(report: Report, ours: dict[int, list[_Run]]) -> None:
    report.section('7. memory of leg_fk bag: peak resident size')
    for length in (min(ours), max(ours)):
        report.row(f'{length} s', figure([run.peak for run in ours[length]]), 'MB', at_most=200.0)


def write_bag(path: Path, seconds: int) -> Path:
    """Write an mcap bag of JointStates at 1 kHz and return its path."""
    import numpy as np
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import get_typestore, Stores
    types = get_typestore(Stores.ROS2_JAZZY)
    JointState = types.types['sensor_msgs/msg/JointState']
    Header = types.types['std_msgs/msg/Header']
    Time = types.types['builtin_interfaces/msg/Time']
    names, zeros = joint_names(_JOINTS), np.zeros(_JOINTS)
    gait = [bytearray(types.serialize_cdr(JointState(
        Header(Time(0, 0), ''), names, np.array(joint_positions(_JOINTS, i / _GAIT_MESSAGES)),
        zeros, zeros), 'sensor_msgs/msg/JointState')) for i in range(_GAIT_MESSAGES)]
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/joint_states', 'sensor_msgs/msg/JointState',
                                           typestore=types)
        for i in range(seconds * _RATE):
            stamp = _START + i * 1_000_000_000 // _RATE
            message = gait[i % _GAIT_MESSAGES]
            sec, nanosec = divmod(stamp, 1_000_000_000)
            message[4:12] = sec.to_bytes(4, 'little') + nanosec.to_bytes(4, 'little')
            writer.write(connection, stamp, bytes(message))
    return path


def _time(command: Sequence[str], output: Path, one_core: bool = False) -> _Run:
    """Run a command that makes `output`, its last argument; remove what it made."""
    cores = os.sched_getaffinity(0)
    if one_core:  # inherited by the process
        os.sched_setaffinity(0, {min(cores)})
    began = time.perf_counter()
    process = subprocess.Popen([*command, str(output)], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    os.sched_setaffinity(0, cores)
    peak = 0
    while process.poll() is None:
        peak = max(peak, peak_resident_bytes(process.pid))
        try:
            process.wait(timeout=0.02)
        except subprocess.TimeoutExpired:
            continue
    seconds = time.perf_counter() - began
    if process.returncode != 0:
        raise RuntimeError(f'{" ".join(command)}: {process.communicate()[1].strip()}')
    shutil.rmtree(output)
    return _Run(seconds, peak / 1e6)
