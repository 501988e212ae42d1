"""`leg_fk demo`: the node in its own process over DDS, from outside."""

from contextlib import closing
import fcntl
import os
from pathlib import Path
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time

from icub_leg_fk.__main__ import main
from icub_leg_fk.commands.demo import conclude
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.gait import walk

pytest.importorskip('matplotlib')
pytest.importorskip('rclpy', reason='needs ROS 2')
replays = pytest.importorskip('icub_leg_fk.tools.replay')

DEMO = (sys.executable, '-m', 'icub_leg_fk', 'demo')
TIPS = ('left_foot', 'right_foot')


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    root = str(Path(__file__).parents[2])
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(
        filter(None, (root, os.environ.get('PYTHONPATH')))))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.delenv('NO_COLOR', raising=False)
    monkeypatch.chdir(tmp_path)


def demo(*words, **environment):
    return subprocess.run([*DEMO, *words], capture_output=True, text=True, check=False,
                          timeout=90, env={**os.environ, **environment})


def children(pid):
    """Return the processes that a process has started and that still run."""
    try:
        return [int(word) for word in
                Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]
    except OSError:
        return []


def runs(pid):
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


def wait_until(condition, timeout=90.0):
    deadline = time.monotonic() + timeout
    while not (value := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return value


def write_csv(path, times, names, positions):
    """Write a recording with columns that the demonstration does not need."""
    rows = [f'{t:.4f},0,' + ','.join(map(repr, q.tolist())) for t, q in zip(times, positions)]
    path.write_text('\n'.join([f'time,force_z,{",".join(names)}', *rows]))
    return path


def test_every_pose_of_the_gait_arrives_and_is_drawn_and_kept():
    done = demo('--seconds', '2.5', '--save', 'walk')
    assert (done.returncode, done.stderr) == (0, '')
    assert re.search(r'messages in +251\b', done.stdout)
    assert re.search(r'poses out +502 +\(left_foot 251, right_foot 251\)', done.stdout)
    assert re.search(r'lost +none', done.stdout)
    assert re.search(r'latency +median [\d.]+ ms +p99 [\d.]+ ms +max [\d.]+ ms', done.stdout)
    assert Path('demo.png').read_bytes().startswith(b'\x89PNG')
    assert sorted(path.name for path in Path().iterdir()) == ['demo.png', 'walk']
    # Without a terminal there is a plain line a second, and one of the last state.
    assert '\x1b' not in done.stdout
    lines = re.findall(r'^ +([\d.]+) s   in root_link: left foot: .*   right foot: x \S+',
                       done.stdout, re.MULTILINE)
    assert lines[-1] == '2.50' and 2 <= len(lines) <= 4
    # What was sent can be converted and drawn.
    assert main(['bag', 'walk', 'poses']) == 0
    assert main(['plot', 'poses']) == 0


def test_talks_inside_the_machine_in_a_domain_and_namespace_of_its_own(monkeypatch):
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    (one, namespace), (two, other_namespace) = where_it_talks(), where_it_talks()
    assert 1 <= one <= 101
    assert 1 <= two <= 101
    assert namespace != other_namespace


def test_users_domain_stays(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '73')
    assert where_it_talks()[0] == 73


def where_it_talks():
    process = subprocess.Popen(DEMO, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stdout:
        if match := re.match(r'\(this machine only, ROS_DOMAIN_ID (\d+), namespace (\S+)\)', line):
            break
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=90)
    return int(match[1]), match[2]


def test_recording_is_played_in_its_own_timing():
    gait = walk(Catalog.load(), 'v2_5', seconds=1.0, rate=50.0)
    times = np.cumsum(np.r_[5.0, np.tile([0.002, 0.04, 0.0], 17)[:49]])  # 0.7 s, from 5 s on
    write_csv(Path('walk.csv'), times, gait.joint_names[::-1], gait.positions[:, ::-1])
    done = demo('--recording', 'walk.csv', '-o', 'walk.svg')
    assert done.returncode == 0, done.stderr
    assert f'messages in   50  in {times[-1] - times[0]:.2f} s' in done.stdout
    assert re.search(r'poses out +100 ', done.stdout)
    assert Path('walk.svg').is_file()


@pytest.mark.parametrize(('version', 'foot_frame'), [('v1', 'dh'), ('v2_5', 'sole')])
def test_poses_received_are_those_of_the_chains(version, foot_frame):
    """In the order of the messages, equal to the plain product of the DH matrices."""
    namespace = '/leg_fk_test'
    parameters = {'version': version, 'foot_frame': foot_frame,
                  **replays.lossless(namespace, TIPS, 1000)}
    catalog = Catalog.load()
    gait = walk(catalog, version, seconds=0.5)
    with closing(replays.Replay(gait, namespace, TIPS)) as replay, \
            replays.running_node(namespace, parameters) as (_, check):
        replay.wait_for_node(check)
        replay.play(lambda elapsed: None, 0.1, check)
    for answers, name, q in zip(replay.answers, ('left_leg', 'right_leg'),
                                np.hsplit(gait.positions, 2)):
        T = catalog.chain(name, version, foot_frame).forward(q)
        assert (answers.arrived, answers.unexpected) == (len(gait.times), 0)
        assert np.abs(answers.poses[:, :3] - T[:, :3, 3]).max() < 1e-12
        assert (answers.latencies > 0).all()


@pytest.mark.parametrize(('missing', 'counts'), [
    (slice(3, 5), r'18 +\(left_foot 10, right_foot 8\)\nlost +2\n'),
    (slice(None), r'10 +\(left_foot 10, right_foot 0\)\nlost +10\n')])
def test_lost_poses_are_told_and_exit_1(capsys, missing, counts):
    answers = [replays.Answers(tip, np.zeros((10, 7)), np.full(10, 1e-3)) for tip in TIPS]
    answers[1].latencies[missing] = np.nan
    assert conclude(answers, list(range(10)), True) == 1
    captured = capsys.readouterr()
    assert re.search(f'poses out +{counts}', captured.out)
    assert captured.err.count('\n') == 1
    assert 'did not arrive' in captured.err


def test_nohup_is_respected():
    """A demonstration that was told to ignore SIGHUP goes on."""
    process = subprocess.Popen(['nohup', *DEMO, '--seconds', '2'], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True)
    read_until(process.stdout, 'right foot: ')
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=90)
    assert process.returncode == 0


def test_node_that_refuses_its_parameters_is_one_line():
    with pytest.raises(replays.DemoError, match=r'exit status 1: .*v9.*v2_5'), \
            replays.running_node('/leg_fk_test', {'version': 'v9'}) as (_, check):
        wait_until(check)


def test_node_that_dies_is_one_line_and_exit_1():
    process = subprocess.Popen([*DEMO, '--seconds', '60'], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    node, = wait_until(lambda: children(process.pid))
    read_until(process.stdout, 'right foot: x')
    os.kill(node, signal.SIGKILL)
    _, err = process.communicate(timeout=90)
    assert process.returncode == 1
    assert err.count('\n') == 1
    assert 'the node stopped with exit status -9' in err


def read_until(stream, text):
    for line in stream:
        if text in line:
            return
    raise AssertionError(f'no {text!r}')


@pytest.mark.parametrize(('number', 'status', 'early'), [
    (signal.SIGINT, 130, True), (signal.SIGINT, 130, False), (signal.SIGTERM, 143, False),
    (signal.SIGHUP, 129, False)])
def test_signals_leave_no_process_and_no_file_behind(number, status, early):
    process = subprocess.Popen([*DEMO, '--seconds', '60', '--save', 'walk'],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    node, = wait_until(lambda: children(process.pid))
    if not early:
        read_until(process.stdout, 'right foot: x')
    process.send_signal(number)
    out, err = process.communicate(timeout=90)
    assert (process.returncode, err) == (status, '')
    assert ('messages in' in out and 'interrupted' in out) == (status == 130 and not early)
    wait_until(lambda: not runs(node))
    assert list(Path().iterdir()) == []


def size_of_terminal(terminal, rows, columns):
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack('HHHH', rows, columns, 0, 0))


def on_a_terminal(*words, sizes=((40, 100),), **environment):
    """Return what the demonstration writes on a terminal, and how it ends.

    Args:
        words: its arguments.
        sizes: rows and columns of the terminal at first, and after each further five pictures.
        environment: variables to set.
    """
    controller, terminal = pty.openpty()
    size_of_terminal(terminal, *sizes[0])
    left_out = {'COLUMNS', 'LINES'}
    process = subprocess.Popen(
        [*DEMO, *words], stdin=terminal, stdout=terminal, stderr=terminal,
        env={**{name: value for name, value in os.environ.items() if name not in left_out},
             'TERM': 'xterm-256color', 'PYTHONIOENCODING': 'utf-8', **environment})
    os.close(terminal)
    written, later = b'', list(sizes[1:])
    while select.select([controller], [], [], 60)[0]:
        try:
            data = os.read(controller, 65536)
        except OSError:  # the other end is closed
            break
        written += data
        if later and written.count(HOME) >= 5 * (len(sizes) - len(later)):
            size_of_terminal(controller, *later.pop(0))
    os.close(controller)
    assert process.wait(90) == 0
    return written.decode()


HOME = b'\x1b[H'


def plain(text):
    return re.sub(r'\x1b\[[\d;?]*[A-Za-z]|\r', '', text)


def test_on_a_terminal_the_table_is_redrawn_in_place():
    text = on_a_terminal('--seconds', '2')
    _, *frames = text.split('\x1b[H')
    assert 10 <= len(frames) <= 25  # 10 a second
    assert len(set(re.findall(r'left foot +(-?\d.*\d)', text))) >= 10  # it moves
    assert all('poses in root_link, in m' in frame for frame in frames)
    assert '\x1b[38;5;' in text
    # The second screen and the hidden cursor are given back before the summary.
    assert text.index('\x1b[?1049h') < text.index('\x1b[?1049l') < text.index('messages in')
    assert text.index('\x1b[?25l') < text.index('\x1b[?25h') < text.index('messages in')


def test_a_terminal_that_gets_smaller_shows_what_fits_and_says_what_does_not():
    text = on_a_terminal('--seconds', '4', sizes=((24, 80), (24, 45), (6, 40)), NO_COLOR='1')
    assert not re.search(r'\x1b\[[\d;]*m', text)
    _, *frames = text.partition('\x1b[?1049l')[0].split('\x1b[H')
    assert 'columns' not in frames[0]
    narrow = next(plain(frame) for frame in frames if '4 more columns' in frame)
    assert max(map(len, narrow.splitlines())) <= 45
    assert '     qx' not in narrow and '        z' in narrow
    small = plain(frames[-1]).splitlines()
    assert len(small) == 6 and small[-1] == 'more rows: enlarge the terminal'


@pytest.mark.parametrize(('words', 'named'), [
    (['--version', 'v9'], ['v9', 'v2_5']),
    (['--foot-frame', 'toe'], ['toe', 'sole']),
    (['--seconds', '0'], ['--seconds', '0.1']),
    (['-o', 'demo.gif'], ['.gif', '.png']),
    (['-o', 'none/demo.png'], ['none']),
    (['-o', 'bad.csv.png', '--save', 'none/walk'], ['none']),
    (['--save', 'bad.csv'], ['bad.csv', 'exists']),
    (['--recording', 'no.csv'], ['no.csv']),
    (['--recording', 'bad.csv'], ['bad.csv:3', 'column r_knee', "'nan'"]),
])
def test_bad_input_is_one_line_and_exit_2(capsys, words, named):
    names = [name for leg in ('left_leg', 'right_leg')
             for name in Catalog.load().chain(leg, 'v2_5').joint_names]
    file = write_csv(Path('bad.csv'), [0.0, 0.1], names, np.zeros((2, 12)))
    lines = file.read_text().splitlines()
    cells = lines[2].split(',')
    cells[lines[0].split(',').index('r_knee')] = 'nan'
    file.write_text('\n'.join([*lines[:2], ','.join(cells)]))
    assert main(['demo', *words]) == 2
    captured = capsys.readouterr()
    assert captured.err.count('\n') == 1
    for word in named:
        assert word in captured.err
    assert not Path('demo.png').exists()


@pytest.mark.parametrize('library', ['rclpy', 'matplotlib', 'rosbags'])
def test_missing_library_is_one_line(library):
    code = (f'import sys; sys.modules[{library!r}] = None\n'
            'from icub_leg_fk.__main__ import main\n'
            "sys.exit(main(['demo', '--seconds', '0.2', '--save', 'walk']))")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False, timeout=60)
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert library in done.stderr
