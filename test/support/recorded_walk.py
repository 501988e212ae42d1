"""The recorded walk of a real robot, beside the project, and a synthetic one that is in it."""

from pathlib import Path

import numpy as np
import pytest

FILE = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'icub_genova04_walking.csv'
DATA = Path(__file__).resolve().parent / 'data'

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


def read_synthetic_walk():
    """Return joint names and (N, 12) positions [rad]."""
    with (DATA / 'synthetic_walk.csv').open() as lines:
        _, *names = next(lines).strip().split(',')
        return names, np.array([[float(text) for text in line.split(',')[1:]] for line in lines])
