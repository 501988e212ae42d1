"""`leg_fk demo`: the node in its own process over DDS, from outside."""

import os
from pathlib import Path
import pty
import re
import select
import shlex
import signal
import subprocess
import sys
import time

from icub_leg_fk import Catalog, MissingDependencyError
from icub_leg_fk.commands.demo import conclude
from icub_leg_fk.kinematics import config_file
from icub_leg_fk.stream.configuration import LEGS
from icub_leg_fk.tools import replay as replays
from icub_leg_fk.tools.recording import read_joints
from icub_leg_fk.tools.ros import running_ros
from icub_leg_fk.tools.terminal import import_rich
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main

pytest.importorskip('matplotlib')
pytest.importorskip('rclpy', reason='needs ROS 2')

DEMO = (sys.executable, '-m', 'icub_leg_fk', 'demo')
TIPS = ('left_foot', 'right_foot')
CHAINS = Catalog.load().select(LEGS)
JOINTS = [name for chain in CHAINS for name in chain.joint_names]


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    clone = str(Path(__file__).parents[2])  # for the processes
    monkeypatch.setenv('PYTHONPATH', clone, prepend=os.pathsep)
    monkeypatch.chdir(tmp_path)


def walk(seconds):
    return read_joints([config_file('examples/synthetic_walk.csv')], CHAINS).first(
        seconds
    )


def start(*words):
    return subprocess.Popen(
        [*DEMO, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def children(pid):
    """Return the processes that a process has started and that still run."""
    try:
        listed = Path(f'/proc/{pid}/task/{pid}/children').read_text()
    except OSError:
        return []
    return [int(word) for word in listed.split()]


def runs(pid):
    try:
        return (
            Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
        )
    except OSError:
        return False


def wait_until(condition, timeout=90.0):
    deadline = time.monotonic() + timeout
    while not (value := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return value


def read_until(stream, text):
    for line in stream:
        if text in line:
            return
    raise AssertionError(f'no {text!r}')


def write_csv(path, times, positions):
    """Write a recording in another order, with a column that the demonstration does not need."""
    lines = [f'time,force_z,{",".join(JOINTS[::-1])}']
    for t, q in zip(times, positions, strict=True):
        lines.append(f'{t:.4f},0,{",".join(map(repr, q[::-1].tolist()))}')
    path.write_text('\n'.join(lines))


def test_every_pose_of_the_gait_arrives_and_is_drawn_and_kept():
    done = run_main('demo', '--seconds', '1.5', '--save', 'walk')
    assert (done.returncode, done.stderr) == (0, '')
    for said in (
        r'^iCub legs v2_5: 151 JointState messages',
        r'messages in +151\b',
        r'poses out +302 +\(left_foot 151, right_foot 151\)',
        r'lost +none',
        r'latency +median [\d.]+ ms +p99 [\d.]+ ms +max [\d.]+ ms',
    ):
        assert re.search(said, done.stdout)
    assert Path('demo.png').read_bytes().startswith(b'\x89PNG')
    assert sorted(path.name for path in Path().iterdir()) == ['demo.png', 'walk']
    # Without a terminal there is a plain line a second, and one of the last state.
    assert '\x1b' not in done.stdout
    lines = re.findall(
        r'^ +([\d.]+) s   in root_link: left foot: .*   right foot: x \S+',
        done.stdout,
        re.MULTILINE,
    )
    assert lines[-1] == '1.50' and 2 <= len(lines) <= 3
    # What was sent can be converted and drawn.
    assert run_main('bag', 'walk', 'poses').returncode == 0
    assert run_main('plot', 'poses').returncode == 0


def test_talks_inside_the_machine_in_a_domain_of_its_own(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    monkeypatch.setenv('ROS_STATIC_PEERS', '192.0.2.1')
    monkeypatch.setenv('ROS_DOMAIN_ID', '73')
    assert replays.stay_on_this_machine() == '73'  # which is the user's
    monkeypatch.delenv('ROS_DOMAIN_ID')
    assert 1 <= int(replays.stay_on_this_machine()) <= 101
    assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert 'ROS_STATIC_PEERS' not in os.environ


def test_recording_is_played_in_its_own_timing_to_a_robot_of_a_urdf():
    assert run_main('urdf', 'left_leg', 'right_leg', '-o', 'robot.urdf').returncode == 0
    times = np.cumsum(
        np.r_[5.0, np.tile([0.002, 0.04, 0.0], 17)[:49]]
    )  # 0.7 s, from 5 s on
    write_csv(Path('walk.csv'), times, walk(0.49).positions)
    done = run_main(
        'demo', '-k', 'robot.urdf', '--recording', 'walk.csv', '-o', 'walk.svg'
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith('iCub legs urdf: 50 JointState messages')
    assert f'namespace /leg_fk_demo_{os.getpid()})' in done.stdout
    assert f'messages in   50  in {times[-1] - times[0]:.2f} s' in done.stdout
    assert re.search(r'poses out +100 ', done.stdout)
    assert Path('walk.svg').is_file()


@pytest.mark.parametrize(('version', 'foot_frame'), [('v1', 'dh'), ('v2_5', 'sole')])
def test_poses_received_are_those_of_the_chains(version, foot_frame):
    """In the order of the messages, equal to the plain product of the DH matrices."""
    namespace = '/leg_fk_test'
    parameters = {'version': version, 'foot_frame': foot_frame}
    parameters |= replays.lossless(namespace, TIPS, 1000)
    gait = walk(0.5)
    with (
        running_ros('the test', 'leg_fk_test', namespace) as ros,
        replays.running_node(namespace, parameters) as (_, check),
    ):
        replay = replays.Replay(ros, gait, TIPS)
        replay.wait_for_node(check)
        replay.play(lambda elapsed: None, 0.1, check)
    chains = Catalog.load().select(LEGS, version)
    for answers, chain, q in zip(replay.answers, chains, np.hsplit(gait.positions, 2)):
        T = chain.with_frame(foot_frame).forward(q)
        assert (answers.arrived, answers.unexpected) == (len(gait.times), 0)
        assert np.abs(answers.poses[:, :3] - T[:, :3, 3]).max() < 1e-12
        assert (answers.latencies > 0).all()


@pytest.mark.parametrize(
    ('missing', 'counts'),
    [
        (slice(3, 5), r'18 +\(left_foot 10, right_foot 8\)\nlost +2\n'),
        (slice(None), r'10 +\(left_foot 10, right_foot 0\)\nlost +10\n'),
    ],
)
def test_lost_poses_are_reported_and_exit_1(capsys, missing, counts):
    answers = [
        replays.Answers(tip, np.zeros((10, 7)), np.full(10, 1e-3)) for tip in TIPS
    ]
    answers[1].latencies[missing] = np.nan
    assert conclude(answers, list(range(10)), True) == 1
    captured = capsys.readouterr()
    assert re.search(f'poses out +{counts}', captured.out)
    assert captured.err.count('\n') == 1
    assert 'did not arrive' in captured.err


def test_node_that_refuses_its_parameters_is_one_line():
    with (
        pytest.raises(replays.DemoError, match=r'exit status 1: .*v9.*v2_5'),
        replays.running_node('/leg_fk_test', {'version': 'v9'}) as (_, check),
    ):
        wait_until(check)


@pytest.mark.parametrize(
    ('victim', 'number', 'early', 'status', 'complaint'),
    [
        ('demo', signal.SIGINT, False, 130, ''),
        ('demo', signal.SIGTERM, True, 143, ''),
        ('node', signal.SIGKILL, False, 1, 'the node stopped with exit status -9'),
    ],
)
def test_an_early_end_leaves_no_process_and_no_file_behind(
    victim, number, early, status, complaint
):
    process = start('--seconds', '60', '--save', 'walk')
    (node,) = wait_until(lambda: children(process.pid))
    if not early:
        read_until(process.stdout, 'right foot: x')
    os.kill({'demo': process.pid, 'node': node}[victim], number)
    out, err = process.communicate(timeout=90)
    assert (process.returncode, err.count('\n')) == (status, bool(complaint))
    assert complaint in err
    is_summed_up = number == signal.SIGINT
    assert ('messages in' in out and 'interrupted' in out) == is_summed_up
    wait_until(lambda: not runs(node))
    assert not list(Path().iterdir())


def test_on_a_terminal_the_table_is_redrawn_in_place():
    pytest.importorskip('rich')
    controller, terminal = pty.openpty()
    environment = {
        **os.environ,
        'TERM': 'xterm-256color',
        'COLUMNS': '90',
        'LINES': '30',
    }
    process = subprocess.Popen(
        [*DEMO, '--seconds', '1.5'],
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env=environment,
    )
    os.close(terminal)
    written = b''
    while select.select([controller], [], [], 60)[0]:
        try:
            written += os.read(controller, 65536)
        except OSError:  # the other end is closed
            break
    os.close(controller)
    assert process.wait(90) == 0
    shown = re.sub(r'\x1b\[[\d;?]*[A-Za-z]|\r', '', written.decode())
    table, _, summary = shown.partition('messages in')
    assert 8 <= table.count('poses in root_link, in m') <= 20  # 10 a second
    assert len(set(re.findall(r'left foot +(-?\d.*\d)', table))) >= 8  # it moves
    assert 'poses out' in summary and 'poses in' not in summary


@pytest.mark.parametrize(
    ('typed', 'named'),
    [
        ('--version v9', ['v9', 'v2_5']),
        ('--foot-frame toe', ['toe', 'sole']),
        ('--seconds 0', ['--seconds', '0.1']),
        ('-o demo.gif', ['.gif', '.png']),
        ('-o none/demo.png', ['none']),
        ('-o /proc/demo.png', ['/proc/demo.png', 'cannot be written']),
        ('-k panda.yaml', ["unknown chain 'left_leg'", 'known: panda']),
        ('-o bad.csv.png --save none/walk', ['none']),
        ('--save bad.csv', ['bad.csv', 'exists']),
        ('--save kept.mcap', ['kept.mcap', '--force']),
        ('--recording no.csv', ['no.csv']),
        ('--recording bad.csv', ['bad.csv:3', 'column r_knee', "'1e+300'"]),
    ],
)
def test_bad_input_is_one_line_and_exit_2(typed, named):
    positions = np.zeros((2, 12))
    positions[1, JOINTS.index('r_knee')] = 1e300
    write_csv(Path('bad.csv'), [0.0, 0.1], positions)
    Path('kept.mcap').touch()
    Path('panda.yaml').symlink_to(config_file('examples/panda.yaml'))
    done = run_main('demo', *shlex.split(typed))
    for word in named:
        assert_one_line_complaint(done, word)
    assert not Path('demo.png').exists()


@pytest.mark.parametrize('library', ['rclpy', 'matplotlib', 'rosbags'])
def test_missing_library_is_one_line(library, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    done = run_main('demo', '--seconds', '0.2', '--save', 'walk')
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert library in done.stderr


def test_missing_rich_is_an_error_that_says_what_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'rich', None)
    with pytest.raises(MissingDependencyError, match=r'the live table needs rich.*pip'):
        import_rich('the live table')
