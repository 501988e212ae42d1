"""ament_flake8, with the settings of every ROS 2 package, finds nothing in what is installed."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_ament_flake8_finds_nothing(monkeypatch):
    ament_flake8 = pytest.importorskip('ament_flake8.main')
    monkeypatch.chdir(ROOT)
    # Of tests, benchmarks and documentation ruff asks the same, in a hundredth of the time.
    code, errors = ament_flake8.main_with_errors(
        argv=['setup.py', 'icub_leg_fk', 'launch']
    )
    assert code == 0, f'{len(errors)} errors:\n' + '\n'.join(errors)
