"""`leg_fk table`: the file it writes is its URDF, is read by every command, and replaces none."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from icub_leg_fk.kinematics import Catalog, Chain, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main
from support.robots import joint, robot

ARM = robot(
    [
        joint(0, 'prismatic', '0 0.1 0.2'),
        joint(1, xyz='0.3 0 0', rpy='1.5707963267948966 0 0'),
        joint(2, xyz='0.2 0.1 0', rpy='0.3 -0.2 0.1', axis='0 1 0'),
        joint(3, 'fixed', '0 0 1'),
    ]
).replace('l4', 'tool')
WORDS = ('--root', 'l0', '--tips', 'tool', '--name', 'arm')


@pytest.fixture
def made(tmp_path: Path) -> Callable[..., Any]:
    """Return what makes tables of a URDF with options, and gives their catalog and the report."""

    def make(text: str, *words: Any) -> tuple[Catalog, str]:
        (tmp_path / 'robot.urdf').write_text(text)
        done = run_main('table', tmp_path / 'robot.urdf', *words)
        assert done.returncode == 0, done.stderr
        (tmp_path / 'table.yaml').write_text(done.stdout)
        return Catalog.load(tmp_path / 'table.yaml'), done.stderr

    return make


def off(chain: Chain, urdf: Path) -> float:
    """Return how far a chain is from a URDF in some postures, in mm or deg."""
    robot_frame = partial(Urdf.load(urdf).forward, chain.root_frame, chain.frame_id)
    return max(difference(chain.forward, robot_frame, postures(chain, 100)))


def test_the_file_is_taken_by_every_command_and_comes_back_from_its_urdf(
    tmp_path: Path,
) -> None:
    file, table, urdf = (tmp_path / name for name in ('a.urdf', 'a.yaml', 'b.urdf'))
    file.write_text(ARM)
    done = run_main('table', file, *WORDS, '-o', table)
    report = 'arm (frames: tool): 3 joints; largest difference from the URDF in 1000'
    assert f'{table}: arm\n{report} postures: ' in done.stdout
    chain = Catalog.load(table).chain('arm')
    q = ['--radians', '0.1', '0.2', '0.3']
    for command in (
        ['pose', 'arm', '-k', table, *q],
        ['explain', 'arm', '-k', table, *q],
        ['list', '-k', table],
        ['urdf', 'arm', '-k', table, '-o', urdf],
    ):
        assert run_main(*command).returncode == 0
    assert off(chain, urdf) < 1e-6
    assert_one_line_complaint(
        run_main('table', file, *WORDS, '-o', table), 'exists already'
    )


@pytest.mark.parametrize('convention', ['standard', 'modified'])
def test_without_output_the_file_is_printed_and_the_report_is_not_in_it(
    convention: str, made: Callable[..., Any], tmp_path: Path
) -> None:
    catalog, report = made(ARM, *WORDS, '--convention', convention)
    chain = catalog.chain('arm')
    assert chain.convention == convention
    assert (chain.root_frame, chain.frame_id) == ('l0', 'tool')
    assert chain.lower == pytest.approx([-2, -2, -2], abs=1e-11)
    assert off(chain, tmp_path / 'robot.urdf') < 1e-6
    assert report.startswith('arm (frames: tool): 3 joints; largest difference')
    again = catalog, report
    assert made(ARM, *WORDS, '--convention', convention, '-o', '-') == again


def test_chains_that_share_joints_go_into_one_urdf(
    made: Callable[..., Any], tmp_path: Path
) -> None:
    turned = joint(1, xyz='0.3 0 0', rpy='1.5707963267948966 0 0')
    one = joint(2, xyz='0.2 0 0.1', axis='0 1 0')
    other = joint(2, xyz='0 0.3 0', rpy='0 1 0').replace('j2', 'k2').replace('l3', 'm3')
    text = robot([joint(0), turned, one, other]).replace('l4', 'm3')
    catalog, _ = made(text, '--root', 'l0', '--tips', 'l3', 'm3')
    both = tmp_path / 'both.urdf'
    assert run_main('urdf', '-k', catalog.file, '-o', both).returncode == 0
    kinds = [element.kind for element in Urdf.load(both).joints]
    assert kinds.count('revolute') == 4
    for tip in ('l3', 'm3'):
        for file in (both, tmp_path / 'robot.urdf'):
            assert off(catalog.chain(tip), file) < 1e-6


def test_names_are_any_text_of_one_line(
    made: Callable[..., Any], tmp_path: Path
) -> None:
    names = {
        'j0': 'robot::arm::j1',
        'j1': 'Revolute 2',
        'j2': 'j3 (1)',
        'l3': 'the [x]',
    }
    text = robot([joint(0), joint(1, xyz='0.3 0 0'), joint(2, xyz='0.2 0 0')])
    for old, new in names.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    catalog, _ = made(text, '--tips', 'the [x]')
    chain = catalog.chain('the [x]')
    assert [*chain.joint_names, chain.frame_id] == [*names.values()]
    assert chain.tip == 'the__x_'
    assert chain.forward([0, np.pi / 2, 0])[:3, 3] == pytest.approx([0.3, 0.2, 0])
    file = tmp_path / 'robot.urdf'
    file.write_text(text.replace('Revolute 2', 'Revolute&#10;2'))
    assert_one_line_complaint(
        run_main('table', file, '--tips', 'the [x]'),
        'cannot be written as a kinematics',
    )


ICUBS = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'


@pytest.mark.skipif(not ICUBS.is_dir(), reason='../shared has the URDFs of iCubs')
def test_of_an_icub_the_shipped_chains_are_written_tidied_and_their_cost_reported(
    tmp_path: Path,
) -> None:
    table = tmp_path / 'nancy.yaml'
    done = run_main('table', ICUBS / 'iCubNancy01.urdf', '-o', table)
    assert done.stdout.startswith(f'{table}: left_leg, right_leg, head_imu\n')
    leg = Catalog.load(table).chain('left_leg')
    assert [*leg.tip_frames] == ['dh', 'sole'] and leg.tip == 'left_foot'
    assert np.degrees([link.offset for link in leg.links]).tolist() == [
        0,
        90,
        -90,
        90,
        0,
        0,
    ]
    assert (
        'left_leg (frames: dh, sole): 6 joints; largest difference from the URDF in 1000 '
        in (done.stdout)
    )
    cost = float(done.stdout.split('postures: ')[1].split(' mm')[0])
    for frame in ('dh', 'sole'):
        assert (
            0.001 < off(leg.with_frame(frame), ICUBS / 'iCubNancy01.urdf') < cost + 1e-4
        )


def test_rows_that_follow_are_written_and_read(
    made: Callable[..., Any], tmp_path: Path
) -> None:
    mimic = '<mimic joint="j0" multiplier="0.5" offset="0.2"/>'
    joints = [joint(0), joint(1, xyz='0.1 0 0', more=mimic), joint(2, xyz='0.1 0 0')]
    catalog, _ = made(robot(joints), '--tips', 'l3')
    chain = catalog.chain('l3')
    assert chain.joint_names == ('j0', 'j2') and len(chain.links) == 3
    assert off(chain, tmp_path / 'robot.urdf') < 1e-6


def test_a_joint_without_bounds_is_compared_over_a_whole_turn(
    made: Callable[..., Any],
) -> None:
    text = robot([joint(0), joint(1, xyz='0.3 0 0')])
    catalog, report = made(text.replace('lower="-2" upper="2" ', ''), '--tips', 'l2')
    assert not any(link.has_limits for link in catalog.chain('l2').links)
    assert '0.0000 mm' in report


@pytest.mark.parametrize(
    ('words', 'complaint'),
    [
        ([], 'give --tips, such as tool'),
        (['--tips', 'l9'], "unknown chain 'l9'; known: tool"),
        (['--tips', 'tool', 'l3', '--name', 'arm'], '2 different names'),
        (['--root', 'l9'], "unknown link 'l9'"),
    ],
)
def test_a_bad_name_is_refused_in_one_line(
    words: list[str], complaint: str, tmp_path: Path
) -> None:
    file = tmp_path / 'robot.urdf'
    file.write_text(ARM)
    assert_one_line_complaint(run_main('table', file, *words), complaint)
    file.unlink()
    assert_one_line_complaint(run_main('table', file, *words), 'no such file')
