"""The recorded walk of a real robot; it lies beside the project, not in it."""

from pathlib import Path

import numpy as np
import pytest

FILE = Path(__file__).resolve().parents[2] / 'shared' / 'data' / 'icub_genova04_walking.csv'

needs_recorded_walk = pytest.mark.skipif(
    not FILE.is_file(), reason=f'the recorded walk is not there: {FILE}')


def read_recorded_walk():
    """Return joint names, times [s], (N, 12) positions [rad] and (N, 2) vertical forces [N]."""
    with FILE.open() as lines:
        header = next(lines).strip().split(',')
        rows = np.array([[float(text) for text in line.split(',')] for line in lines])
    assert header[0] == 'time'
    assert header[-2:] == ['l_foot_force_z', 'r_foot_force_z']
    return header[1:-2], rows[:, 0], rows[:, 1:-2], rows[:, -2:]
