"""ament_flake8, with the settings of every ROS 2 package, finds nothing."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_ament_flake8_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    ament_flake8 = pytest.importorskip('ament_flake8.main')
    monkeypatch.chdir(ROOT)
    folders = [path.name for path in ROOT.iterdir() if any(path.glob('**/*.py'))
               and path.name not in ('build', 'install', 'log') and path.name[0] not in '._']
    code, errors = ament_flake8.main_with_errors(argv=['setup.py', *sorted(folders)])
    assert code == 0, f'{len(errors)} errors:\n' + '\n'.join(errors)
