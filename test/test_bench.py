"""`python -m bench --quick` runs to its end, and its references compute the same robot."""

import json
from pathlib import Path
import subprocess
import sys

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
ROW = {'section', 'name', 'median', 'low', 'high', 'readings', 'unit', 'at_most', 'at_least',
       'holds'}


def bench(folder, *arguments):
    run = subprocess.run(
        [sys.executable, '-m', 'bench', *arguments, '--quick', '--json', str(folder / 'b.json'),
         '--picture', str(folder / 'b.png')], cwd=ROOT, capture_output=True, text=True)
    # 1: a promise not kept, for so short a run; or an exception
    assert run.returncode in (0, 1) and 'Traceback' not in run.stderr, run.stderr
    return run.stdout, json.loads((folder / 'b.json').read_text(encoding='utf-8'))


def test_kinematics_are_measured_beside_other_libraries(tmp_path):
    table, report = bench(tmp_path, 'kinematics')
    assert report.keys() == {'date', 'machine', 'rows', 'growth', 'notes'}
    assert all(row.keys() == ROW for row in report['rows'])
    assert all(row['low'] <= row['median'] <= row['high'] for row in report['rows'])
    names = ' '.join([*(row['name'] for row in report['rows']), *report['notes']])
    for name in ('one pose', 'many poses', 'pinocchio', 'pykdl', 'roboticstoolbox', 'memory'):
        assert name in names
        assert name in table
    assert 'another robot' not in table


def test_nodes_are_measured_beside_their_references(tmp_path):
    pytest.importorskip('rclpy')
    table, report = bench(tmp_path, 'node')
    rows = {row['name']: row for row in report['rows']}
    for name in ('ours / floor', 'ours / plain', 'p50, ours / floor', 'p99, ours / plain',
                 'ours less bare', 'ours less bare, lower quartiles'):
        assert rows[name]['at_most'] is not None
        assert name in table
    assert rows['stretches out of order']['median'] == 0
    assert set(report['growth']) == {'joints', 'chains', 'rate'}
    assert (tmp_path / 'b.png').read_bytes().startswith(b'\x89PNG')


def test_bags_are_measured_beside_the_plain_loop(tmp_path):
    pytest.importorskip('rosbags')
    table, report = bench(tmp_path, 'bag')
    rows = {row['name']: row for row in report['rows']}
    for name in ('plain / leg_fk bag', 'times real time',
                 'two bags of 2 s, --jobs 1 / --jobs 2'):
        assert rows[name]['at_least'] is not None
        assert name in table
    assert set(report['growth']) == {'bag'}


def test_the_plain_references_compute_the_same_robot():
    pytest.importorskip('rclpy')
    from bench.reference_nodes import dh_transform, quaternion
    rng = np.random.default_rng(3)
    chain = Catalog.load(None).chain('right_leg', 'v2_5', 'dh')
    for q in rng.uniform(-np.pi, np.pi, (200, 6)).tolist():
        T = chain.T_root_0
        for link, angle in zip(chain.links, q, strict=True):
            T = T @ dh_transform(link.a, link.d, link.alpha, link.offset + angle)
        np.testing.assert_allclose([*T[:3, 3], *abs_sign(quaternion(T))],
                                   [*chain.pose(q)[:3], *abs_sign(chain.pose(q)[3:])], atol=1e-12)


def abs_sign(q):
    """Return the one of q and -q whose w is positive."""
    return np.array(q) * np.copysign(1.0, q[3])


def test_an_unknown_part_is_refused():
    run = subprocess.run([sys.executable, '-m', 'bench', 'nodes'], cwd=ROOT, capture_output=True,
                         text=True)
    assert run.returncode == 2
    assert 'found part nodes, allowed: node, kinematics, bag' in run.stderr
