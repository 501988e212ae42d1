"""The recorded walk of a real robot, beside the project, and a synthetic one that is in it."""

from pathlib import Path

import numpy as np
import pytest

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data'
FILE = SHARED / 'icub_genova04_walking.csv'
DATA = Path(__file__).resolve().parent / 'data'

needs_recorded_walk = pytest.mark.skipif(
    not FILE.is_file(), reason=f'the recorded walk is not there: {FILE}'
)


def read_recorded_walk():
    """Return joint names, times [s], (N, 12) positions [rad] and (N, 2) vertical forces [N]."""
    names, rows = _read(FILE)
    assert names[0] == 'time'
    assert names[-2:] == ['l_foot_force_z', 'r_foot_force_z']
    return names[1:-2], rows[:, 0], rows[:, 1:-2], rows[:, -2:]


def read_synthetic_walk():
    """Return joint names and (N, 12) positions [rad]."""
    names, rows = _read(DATA / 'synthetic_walk.csv')
    return names[1:], rows[:, 1:]


def _read(file):
    """Return the names of the columns and the numbers."""
    with file.open() as lines:
        names = next(lines).strip().split(',')
    return names, np.loadtxt(file, delimiter=',', skiprows=1)
