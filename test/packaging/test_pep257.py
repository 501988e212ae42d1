"""ament_pep257 finds nothing; it is asked for the Google convention, which this project uses."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# A magic method does what its name says; __init__ is described by its class.
NOT_ASKED = {'icub_leg_fk': 'D105 D107', 'launch': 'D105 D107'}
# A test's name is its sentence.
NOT_ASKED['test'] = 'D105 D107 D100 D101 D102 D103 D104 D106'


@pytest.mark.parametrize('folder', NOT_ASKED)
def test_ament_pep257_finds_nothing(folder, capsys):
    ament_pep257 = pytest.importorskip('ament_pep257.main')
    words = ['--convention', 'google', '--add-ignore', *NOT_ASKED[folder].split()]
    code = ament_pep257.main(argv=[*words, '--', str(ROOT / folder)])
    assert code == 0, capsys.readouterr().err
