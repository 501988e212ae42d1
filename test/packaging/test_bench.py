"""`python -m bench`: it runs to its end, judges promises rightly, and compares with equals."""

from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest
from support.oracle import quaternion_to_matrix

ROOT = Path(__file__).parents[2]


def bench(*arguments):
    run = subprocess.run(
        [sys.executable, '-m', 'bench', *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert 'Traceback' not in run.stderr, run.stderr
    return run


PROMISES = {
    'start': ['leg_fk pose / imports'],
    'kinematics': ['one pose / Pinocchio', 'many poses, loop over Pinocchio / here'],
    'bag': ['bag, plain loop / here', 'bag, peak memory', '--jobs 1 / --jobs 2'],
    'node': [
        'CPU, here / floor',
        'CPU, with a description / without',
        'CPU, here / plain',
        'p50, here / floor',
    ],
}
NEEDED = {'kinematics': 'pinocchio', 'bag': 'rosbags', 'node': 'rclpy'}


@pytest.mark.parametrize('part', PROMISES)
def test_each_part_is_measured_and_its_promises_are_told_in_the_last_line(part):
    pytest.importorskip(NEEDED.get(part, 'numpy'))
    run = bench(part, '--quick')
    assert run.returncode == 0, run.stderr  # whatever so short a run has found
    last = run.stdout.splitlines()[-1]
    for words in ('promises kept', 'missed', *PROMISES[part]):
        assert words in last


def test_a_missed_promise_is_named_with_its_figure(capsys):
    from bench.report import Report

    report = Report()
    report.row('fast', [1.0, 3.0, 2.0], 'x', at_most=2.0)
    report.row('many', [7.0], 'x', at_least=8.0)
    report.row('free', [9.0], 'us')
    assert report.verdict() == '1 promises kept: fast 2 (≤ 2). 1 missed: many 7 (≥ 8).'
    assert 'missed' in capsys.readouterr().out.splitlines()[-2]


def test_only_with_check_a_missed_promise_is_exit_status_1(monkeypatch):
    from bench import __main__ as bench_main
    from bench import kinematics_bench

    monkeypatch.setattr(
        kinematics_bench,
        'measure_start',
        lambda report, quick: report.row('start', [2.0], 'x', at_most=1.0),
    )
    for words, status in ((['start'], 0), (['start', '--check'], 1)):
        monkeypatch.setattr(sys, 'argv', ['bench', *words])
        assert bench_main.main() == status


def test_the_plain_way_computes_the_same_robot():
    from bench.plain import chains, foot_matrix, quaternion

    for chain in chains():
        for q in np.random.default_rng(3).uniform(-np.pi, np.pi, (100, 6)):
            T = foot_matrix(chain, q)
            assert np.abs(T - chain.forward(q)).max() < 1e-12
            assert np.abs(quaternion_to_matrix(quaternion(T)) - T[:3, :3]).max() < 1e-12


def test_an_unknown_part_is_refused():
    run = bench('nodes')
    assert run.returncode == 2
    assert 'found part nodes, allowed: start, kinematics, node, bag' in run.stderr
