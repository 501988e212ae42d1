"""The script of the documentation, on a real Dask cluster in another process."""

from pathlib import Path
import subprocess
import sys

import pytest
from support.bag_files import LEFT_POSE, poses_of, read_bag, walk, write_bag

SCRIPT = Path(__file__).resolve().parents[2] / 'docs' / 'fleet.py'


def test_a_fleet_of_recordings_is_a_map_over_one_function(tmp_path):
    distributed = pytest.importorskip(
        'dask.distributed', reason='needs dask.distributed'
    )
    for number in range(3):
        write_bag(tmp_path / 'in' / f'walk{number}', joints=walk(20 + number))
    (tmp_path / 'in' / 'broken').mkdir()
    (tmp_path / 'in' / 'broken' / 'metadata.yaml').write_text('nothing')
    with distributed.LocalCluster(
        n_workers=1, processes=True, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        words = [SCRIPT, tmp_path / 'in', tmp_path / 'out', cluster.scheduler_address]
        done = subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, timeout=120
        )
    assert done.returncode == 1, done.stderr
    assert done.stdout.count('Summary(') == 3
    assert 'broken: cannot be read' in done.stderr
    assert done.stderr.endswith('1 of 4 recordings failed\n')
    for number in range(3):
        _, messages = read_bag(tmp_path / 'out' / f'walk{number}')
        assert len(poses_of(messages, LEFT_POSE)) == 20 + number
