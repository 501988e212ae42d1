"""The linters find nothing, with the settings of pyproject.toml; workflows keep their schema."""

import importlib.util
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted(map(str, ROOT.glob('.github/workflows/*.yml')))


@pytest.mark.parametrize(
    'command',
    [
        pytest.param(['ruff', 'check', '--no-fix', '.'], id='ruff'),
        pytest.param(['ruff', 'format', '--check', '.'], id='ruff format'),
        pytest.param(['mypy'], id='mypy --strict'),
        pytest.param(
            [
                'check_jsonschema',
                '--builtin-schema',
                'vendor.github-workflows',
                *WORKFLOWS,
            ],
            id='check-jsonschema',
        ),
    ],
)
def test_linter_finds_nothing(command: list[str]) -> None:
    if importlib.util.find_spec(command[0]) is None:
        pytest.skip(f'{command[0]} is not installed')
    if command == ['mypy'] and np.lib.NumpyVersion(np.__version__) < '2.3.0':
        pytest.skip(
            'the types of this numpy are older than those the package is written to'
        )
    result = subprocess.run(
        [sys.executable, '-m', *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
