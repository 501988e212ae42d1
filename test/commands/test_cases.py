"""Small inputs from public reports, beside the project, each with what is right for it."""

import runpy
import shlex
import sys

import pytest
from support.leg_fk_process import run_main
from support.recorded_walk import SHARED

CASES = SHARED.parent / 'cases'
BOTH_LEGS = '150  added on /foot_pose_publisher/right_foot/pose'
AS_ITS_URDF = '3 joints; largest difference from the URDF in 1000 postures: 0.0000 mm'

# What is typed, the exit status, and words of the answer.
ROWS = [
    ('bag edited_map out', 0, ['200  messages copied', BOTH_LEGS]),
    ('bag no_qos out', 0, ['200  messages copied', BOTH_LEGS]),
    ('bag long out', 0, ['150 messages rejected: position has 13 values for 12']),
    ('poses long', 2, ['no chain has a pose', '13 values for 12 names']),
    ('bag degrees out', 0, ['look like degrees', 'out of range: l_hip_roll']),
    ('plot gap -o x.png --at 20', 2, ['no pose; allowed: 0 to 0.49 s, 40.5 to 41.49']),
    ('plot gap -o x.png', 0, ['150 poses of left_foot']),
    ('bag two_robots out', 0, ["frame ids 'robot1/base' and 'robot2/base'"]),
    ('plot two_robots -o x.png', 0, ["frame ids 'robot1/base' and 'robot2/base'"]),
    ('table no_bounds.urdf --tips tool', 0, [AS_ITS_URDF, 'offset: 0}\n']),
    (
        'pose arm -k scoped.yaml --version v1 --degrees 0 90',
        0,
        ['0.1000000  y  0.0000000  z  0.2'],
    ),
    (
        'table names.urdf --tips tool',
        0,
        [AS_ITS_URDF, '"Revolute 2"', 'robot::arm::j1'],
    ),
    ('table 0_plain.urdf --tips tool', 0, [AS_ITS_URDF]),
    ('table camera.urdf --tips tool', 0, [AS_ITS_URDF]),
    ('list -k deg_typed_rad.yaml', 0, ['alpha: 1.5708 deg is unlikely']),
    ('list -k degrees.urdf', 0, ['limit of -180 and 180 is', 'rpy of -90 0 0 is']),
]

pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason=f'no cases in {CASES}')


@pytest.fixture(scope='module')
def inputs(tmp_path_factory):
    """Return a folder with the files, and the bags that their scripts make."""
    for library in ('matplotlib', 'rosbags'):
        pytest.importorskip(library)
    folder = tmp_path_factory.mktemp('cases')
    for file in CASES.glob('*/*'):
        (folder / file.name).write_bytes(file.read_bytes())
    for script, *words in [
        ('mk_qos.py', folder),
        *(('mk.py', folder / k, k) for k in ('long', 'degrees', 'gap', 'two_robots')),
    ]:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(sys, 'argv', [script, *map(str, words)])
            patched.setattr(sys, 'path', sys.path[:])
            runpy.run_path(str(CASES / script))
    return folder


@pytest.mark.parametrize(('typed', 'status', 'answers'), ROWS)
def test_a_case_is_answered_rightly(
    typed, status, answers, inputs, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    words = []
    for word in shlex.split(typed):
        file = inputs / word
        words.append(file if file.exists() else word)
    done = run_main(*words)
    assert done.returncode == status
    for answer in answers:
        assert answer in done.stdout + done.stderr


def test_five_spellings_of_one_robot_give_one_table(inputs):
    files = [*inputs.glob('[0-9]_*.urdf')]
    tables = set()
    for file in files:
        table = run_main('table', file, '--tips', 'tool').stdout
        tables.add(table.replace(file.name, 'robot.urdf'))
    assert len(files) == 5 and len(tables) == 1
