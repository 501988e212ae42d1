"""`leg_fk table`: the file it writes is its URDF, is read by every command, and replaces none."""

from functools import partial
from pathlib import Path

from icub_leg_fk.kinematics import Catalog, chain_from_urdf, Urdf
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


def test_the_file_is_taken_by_every_command_and_comes_back_from_its_urdf(
    tmp_path: Path,
) -> None:
    file, table, again = (
        tmp_path / name for name in ('arm.urdf', 'arm.yaml', 'again.yaml')
    )
    made = tmp_path / 'made.urdf'
    file.write_text(ARM)
    done = run_main('table', file, *WORDS, '-o', table)
    assert (
        'arm (frames: tool): 3 joints; largest difference from the URDF in 1000 postures: '
        in (done.stdout)
    )
    chain = Catalog.load(table).chain('arm')
    q = ['--radians', '0.1', '0.2', '0.3']
    for command in (
        ['pose', 'arm', '-k', table, *q],
        ['explain', 'arm', '-k', table, *q],
        ['list', '-k', table],
        ['urdf', 'arm', '-k', table, '-o', made],
    ):
        assert run_main(*command).returncode == 0
    assert run_main('table', made, *WORDS, '-o', again).returncode == 0
    back = Catalog.load(again).chain('arm')
    assert max(difference(back.forward, chain.forward, postures(chain, 100))) < 1e-6
    assert (back.joint_names, back.root_frame, back.frame_id) == (
        chain.joint_names,
        'l0',
        'tool',
    )
    assert back.lower == pytest.approx(chain.lower, abs=1e-12)
    assert_one_line_complaint(
        run_main('table', file, *WORDS, '-o', table), 'exists already'
    )


@pytest.mark.parametrize('convention', ['standard', 'modified'])
def test_without_output_the_file_is_printed_and_the_report_is_not_in_it(
    convention: str, tmp_path: Path
) -> None:
    file, table = tmp_path / 'arm.urdf', tmp_path / 'arm.yaml'
    file.write_text(ARM)
    done = run_main('table', file, *WORDS, '--convention', convention)
    table.write_text(done.stdout)
    chain = Catalog.load(table).chain('arm')
    assert chain.convention == convention
    urdf = Urdf.load(file)
    assert (
        max(
            difference(
                chain.forward, partial(urdf.forward, 'l0', 'tool'), postures(chain, 100)
            )
        )
        < 1e-6
    )
    assert done.stderr.startswith('arm (frames: tool): 3 joints; largest difference')


def test_chains_that_share_joints_go_into_one_urdf(tmp_path: Path) -> None:
    branch = (
        joint(2, xyz='0 0.3 0', rpy='0 1 0').replace('j2', 'k2').replace('l3', 'm3')
    )
    text = robot(
        [
            joint(0),
            joint(1, xyz='0.3 0 0', rpy='1.5707963267948966 0 0'),
            joint(2, xyz='0.2 0 0.1', axis='0 1 0'),
            branch,
        ]
    )
    file, table, both = (
        tmp_path / name for name in ('robot.urdf', 'table.yaml', 'both.urdf')
    )
    file.write_text(text.replace('l4', 'm3'))
    assert (
        run_main(
            'table', file, '--root', 'l0', '--tips', 'l3', 'm3', '-o', table
        ).returncode
        == 0
    )
    done = run_main('urdf', '-k', table, '-o', both)
    assert done.returncode == 0, done.stderr
    old, new = Urdf.load(file), Urdf.load(both)
    assert [joint.kind for joint in new.joints].count('revolute') == 4
    for tip in ('l3', 'm3'):
        positions = postures(chain_from_urdf(old, 'l0', tip), 20)
        assert (
            max(
                difference(
                    partial(old.forward, 'l0', tip),
                    partial(new.forward, 'l0', tip),
                    positions,
                )
            )
            < 1e-6
        )


def test_names_are_any_text_of_one_line(tmp_path: Path) -> None:
    file, table = tmp_path / 'robot.urdf', tmp_path / 'table.yaml'
    text = robot([joint(0), joint(1, xyz='0.3 0 0'), joint(2, xyz='0.2 0 0')])
    for old, new in (
        ('"j0"', '"robot::arm::j1"'),
        ('"j1"', '"Revolute 2"'),
        ('"j2"', '"j3 (1)"'),
        ('"l3"', '"the tool [x]"'),
    ):
        text = text.replace(old, new)
    file.write_text(text)
    tips = ('--root', 'l0', '--tips', 'the tool [x]')
    assert run_main('table', file, *tips, '-o', table).returncode == 0
    chain = Catalog.load(table).chain('the tool [x]')
    assert chain.joint_names == ('robot::arm::j1', 'Revolute 2', 'j3 (1)')
    assert (chain.tip, chain.frame_id) == ('the_tool__x_', 'the tool [x]')
    assert chain.forward([0, np.pi / 2, 0])[:3, 3] == pytest.approx([0.3, 0.2, 0])
    file.write_text(text.replace('Revolute 2', 'Revolute&#10;2'))
    assert_one_line_complaint(
        run_main('table', file, *tips), 'cannot be written as a kinematics'
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
    urdf = Urdf.load(ICUBS / 'iCubNancy01.urdf')
    for frame, link in (('dh', 'l_foot_dh_frame'), ('sole', 'l_sole')):
        robot_frame = partial(urdf.forward, 'root_link', link)
        found = difference(
            leg.with_frame(frame).forward, robot_frame, postures(leg, 1000)
        )
        assert 0.001 < found.mm < cost + 1e-4


def test_of_another_robot_the_tips_are_asked_for(tmp_path: Path) -> None:
    file = tmp_path / 'arm.urdf'
    file.write_text(ARM)
    assert_one_line_complaint(run_main('table', file), 'give --tips, such as tool')


def test_rows_that_follow_are_written_and_read(tmp_path: Path) -> None:
    file, table = tmp_path / 'finger.urdf', tmp_path / 'finger.yaml'
    mimic = '<mimic joint="j0" multiplier="0.5" offset="0.2"/>'
    file.write_text(
        robot([joint(0), joint(1, xyz='0.1 0 0', more=mimic), joint(2, xyz='0.1 0 0')])
    )
    assert run_main('table', file, '--tips', 'l3', '-o', table).returncode == 0
    chain, urdf = Catalog.load(table).chain('l3'), Urdf.load(file)
    assert chain.joint_names == ('j0', 'j2') and len(chain.links) == 3
    assert (
        max(
            difference(
                chain.forward, partial(urdf.forward, 'l0', 'l3'), postures(chain, 100)
            )
        )
        < 1e-6
    )


def test_a_joint_without_bounds_is_compared_over_a_whole_turn(tmp_path: Path) -> None:
    file = tmp_path / 'arm.urdf'
    text = robot([joint(0), joint(1, xyz='0.3 0 0')])
    file.write_text(text.replace('lower="-2" upper="2" ', ''))
    done = run_main('table', file, '--tips', 'l2')
    assert 'range' not in done.stdout and '0.0000 mm' in done.stderr


def test_a_bad_urdf_or_name_is_refused_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / 'robot.urdf'
    file.write_text(ARM)
    for words, complaint in (
        (('--tips', 'l9'), "unknown chain 'l9'; known: tool"),
        (('--tips', 'tool', 'l3', '--name', 'arm'), '2 different names'),
    ):
        done = run_main('table', file, '--root', 'l0', *words)
        assert_one_line_complaint(done, complaint)
    assert_one_line_complaint(
        run_main('table', tmp_path / 'none.urdf', *WORDS), 'no such file or directory'
    )


def test_a_minus_sign_is_standard_output(tmp_path: Path) -> None:
    file = tmp_path / 'arm.urdf'
    file.write_text(robot([joint(0), joint(1, xyz='0.3 0 0')]))
    printed = run_main('table', file, '--tips', 'l2', '-o', '-')
    assert printed.returncode == 0
    assert printed.stdout == run_main('table', file, '--tips', 'l2').stdout
    assert 'largest difference' in printed.stderr
