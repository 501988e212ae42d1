"""The linters find nothing, with the settings of pyproject.toml; workflows keep their schema."""

from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    'command',
    [
        'ruff check --no-fix .',
        'ruff format --check .',
        'mypy',
        'check_jsonschema --builtin-schema vendor.github-workflows .github/workflows/test.yml',
    ],
)
def test_linter_finds_nothing(command):
    linter, *words = command.split()
    pytest.importorskip(linter)
    if linter == 'mypy' and np.lib.NumpyVersion(np.__version__) < '2.3.0':
        pytest.skip('this numpy has older types than those the package is written to')
    result = subprocess.run(
        [sys.executable, '-m', linter, *words], cwd=ROOT, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_every_workflow_is_checked():
    assert [file.name for file in ROOT.glob('.github/workflows/*')] == ['test.yml']
