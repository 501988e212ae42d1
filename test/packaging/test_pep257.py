"""ament_pep257 finds nothing; it is asked for the Google convention, which this project uses."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# A magic method does what its name says; __init__ is described by its class.
NOT_ASKED = ['D105', 'D107']
# A test's name is its sentence.
NOT_ASKED_OF_TESTS = ['D100', 'D101', 'D102', 'D103', 'D104', 'D106']


@pytest.mark.parametrize(
    ('folder', 'ignored'),
    [
        ('icub_leg_fk', NOT_ASKED),
        ('launch', NOT_ASKED),
        ('test', NOT_ASKED + NOT_ASKED_OF_TESTS),
    ],
)
def test_ament_pep257_finds_nothing(
    folder: str, ignored: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    ament_pep257 = pytest.importorskip('ament_pep257.main')
    code = ament_pep257.main(
        argv=[
            '--convention',
            'google',
            '--add-ignore',
            *ignored,
            '--',
            str(ROOT / folder),
        ]
    )
    assert code == 0, capsys.readouterr().err
