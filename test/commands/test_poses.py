"""`leg_fk poses`: the same numbers as `leg_fk bag` gives, as CSV text and for numpy."""

from pathlib import Path

from icub_leg_fk import add_foot_poses
import numpy as np
import pytest
from support.bag_files import (
    entries,
    JOINT_STATE,
    joint_state,
    LEFT_TWIST,
    LEGS,
    numbers_of,
    poses_of,
    read_bag,
    SECOND,
    START,
    TWIST,
    walk,
    write_bag,
    write_topics,
)
from support.leg_fk_process import assert_one_line_complaint, peak_of, run_main
from support.recorded_walk import SHARED

POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
RECORDINGS = sorted(
    path.parent for path in SHARED.glob('rosbag2_jazzy/*/metadata.yaml')
)
TIPS = ('left_foot', 'right_foot')
COLUMNS = [f'{tip}_{name}' for tip in TIPS for name in POSE]


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope='module')
def source(tmp_path_factory):
    """Return a bag whose messages are half of both legs, then of the left and right in turn."""
    joints = walk(50)
    for i, (time, _) in enumerate(walk(100)[50:]):
        stamp = time - 40_000
        joints.append((time, joint_state(stamp, LEGS[:6] if i % 2 else LEGS[6:])))
    return write_bag(tmp_path_factory.mktemp('poses') / 'in', joints=joints)


def assert_same(table, bag):
    """Check a table against the poses of a bag, which rosbags decodes: numbers, times, count."""
    _, messages = read_bag(bag)
    for tip in TIPS:
        poses = poses_of(messages, f'/foot_pose_publisher/{tip}/pose')
        stamps = [message.header.stamp for _, message in poses]
        there = np.isfinite(table[f'{tip}_x'])
        assert table['time_ns'][there].tolist() == [
            stamp.sec * SECOND + stamp.nanosec for stamp in stamps
        ]
        expected = [numbers_of(message.pose) for _, message in poses]
        found = np.stack([table[f'{tip}_{name}'][there] for name in POSE], axis=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)


def as_table(path):
    """Return the columns of a CSV file or of arrays, with the times in nanoseconds."""
    if Path(path).suffix == '.npz':
        return dict(np.load(path))
    table = np.genfromtxt(path, delimiter=',', names=True)
    columns = {name: table[name] for name in table.dtype.names}
    rows = Path(path).read_text().splitlines()[1:]
    times = [int(row.partition(',')[0].replace('.', '')) for row in rows]
    return {**columns, 'time_ns': np.array(times)}


@pytest.mark.skipif(not RECORDINGS, reason='the recordings of rosbag2 are not there')
@pytest.mark.parametrize('recording', RECORDINGS, ids=lambda path: path.name)
def test_recordings_of_rosbag2_give_the_numbers_of_bag(recording):
    assert len(RECORDINGS) == 12
    add_foot_poses(recording, 'bag')
    done = run_main('poses', recording, '-o', 'feet.npz')
    assert done.returncode == 0, done.stderr
    assert_same(as_table('feet.npz'), 'bag')


@pytest.mark.parametrize('name', ['feet.csv', 'feet.npz'])
def test_a_row_has_what_a_message_gave(source, name):
    add_foot_poses(source, 'bag')
    done = run_main('poses', source, '-o', name)
    assert done.stdout == (
        f'{name}: 100 rows, 75 poses of left_foot, 75 poses of right_foot\n'
    )
    table = as_table(name)
    assert_same(table, 'bag')
    assert [each for each in table if '_foot_' in each] == COLUMNS
    for column in ('left_foot_x', 'right_foot_qw'):
        assert np.isnan(table[column]).sum() == 25


def test_without_a_file_it_goes_to_standard_output(source):
    run_main('poses', source, '-o', 'feet.csv')
    for words in ((), ('-o', '-')):
        done = run_main('poses', source, *words)
        assert done.stdout == Path('feet.csv').read_text()
    header, first, *_ = done.stdout.splitlines()
    assert header.split(',') == ['time', *COLUMNS]
    assert first.startswith(f'{START // SECOND}.000000000,')


def test_pandas_reads_it(source):
    pandas = pytest.importorskip('pandas')
    for name in ('feet.csv', 'feet.npz'):
        run_main('poses', source, '-o', name)
    text = pandas.read_csv('feet.csv')
    arrays = pandas.DataFrame(dict(np.load('feet.npz')))
    times = text.pop('time')
    pandas.testing.assert_series_equal(times, arrays['time'], rtol=0, atol=1e-9)
    pandas.testing.assert_frame_equal(text, arrays[text.columns], rtol=0, atol=1e-15)


def test_twists_are_those_of_bag(source):
    add_foot_poses(source, 'bag', twist=True)
    done = run_main('poses', source, '-o', 'feet.npz', '--twist')
    assert 'right_leg: no twist from 25 messages' in done.stderr
    table = as_table('feet.npz')
    twists = poses_of(read_bag('bag')[1], LEFT_TWIST, TWIST)
    expected = [numbers_of(message.twist) for _, message in twists]
    names = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')
    found = np.stack([table[f'left_foot_{name}'] for name in names], axis=1)
    there = np.isfinite(found[:, 0])
    np.testing.assert_allclose(found[there], expected, rtol=0, atol=1e-15)


def test_messages_of_one_time_are_one_row_but_not_those_of_a_loop():
    """Two publishers, the right one a little later; then all again, as a looping bag has it."""
    topics = {}
    for leg, names, late in (('left', LEGS[:6], 0), ('right', LEGS[6:], 25_000_000)):
        messages = []
        for i in range(200):
            data = joint_state(START + 10**7 * (i % 100), names)
            messages.append((START + 10**7 * i + late, data))
        topics[f'/{leg}'] = (JOINT_STATE, [], messages)
    write_topics('in', topics)
    done = run_main('poses', 'in', '--joint-topic', *topics, '-o', 'feet.npz')
    assert 'time stepped back' in done.stderr
    table = as_table('feet.npz')
    times = (table['time_ns'] - START) / 1e7
    # Some of the right are alone where the loop begins again.
    assert 200 <= len(times) <= 206
    assert times[:90].tolist() == list(range(90))
    assert np.isfinite(table['left_foot_x']).sum() == 200
    assert np.isfinite(table['right_foot_x'][:90]).all()


def test_the_notes_are_those_of_bag():
    joints = [
        (time, joint_state(time, positions=[60.0] * 12, frame_id=f'robot{i % 2}/base'))
        for i, (time, _) in enumerate(walk(20))
    ]
    write_bag('in', joints=joints)
    warnings = add_foot_poses('in', 'bag').warnings
    assert len(warnings) >= 6
    lines = [f'leg_fk: warning: {line}\n' for line in warnings]
    assert run_main('poses', 'in').stderr == ''.join(lines)


@pytest.mark.parametrize(
    ('words', 'complaint'),
    [
        ('-o feet.txt', 'feet.txt: found .txt, allowed: .csv, .npz'),
        ('-o none/feet.csv', 'there is no directory'),
        ('--output=-feet.csv', './-feet.csv'),
        ('--chains arm', "unknown chain 'arm'"),
        ('--version v9', "'v9'"),
        ('--foot-frame toe', "'toe'"),
        ('--time-unit h', "invalid choice: 'h'"),
    ],
)
def test_wrong_words_are_one_line(source, words, complaint):
    assert_one_line_complaint(run_main('poses', source, *words.split()), complaint)
    assert entries('.') == []


def test_a_recording_without_a_pose_leaves_nothing():
    write_bag('in', joints=[(START, joint_state(START, ['L_KNEE']))], others=False)
    for words in ((), ('-o', 'feet.csv'), ('-o', 'feet.npz')):
        assert_one_line_complaint(
            run_main('poses', 'in', *words), 'no chain has a pose: left_leg'
        )
    assert entries('.') == ['in']


@pytest.mark.parametrize(
    ('command', 'output', 'lengths'),
    [('plot', 'x.png', (132, 264)), ('poses', 'x.npz', (33, 132))],
)
def test_memory_hardly_grows_with_a_recording(command, output, lengths):
    """Peak resident size, for a recording at 1 kHz and a longer one.

    Those of plot are just so long that the rows it keeps have been halved in number once more.
    Large blocks go back to the system at once, else the peaks differ by 20 MB from run to run.
    """
    at_once = {'MALLOC_MMAP_THRESHOLD_': '65536'}
    walked = walk(1000, rate=1000.0, names=LEGS)
    peaks = []
    for seconds in lengths:
        joints = []
        for i in range(seconds):
            for time, data in walked:
                now = time + SECOND * i
                stamp = np.array(divmod(now, SECOND), dtype='<u4').tobytes()
                joints.append((now, data[:4] + stamp + data[12:]))
        write_bag(f'{seconds}', joints=joints, others=False)
        words = (command, seconds, '-o', output, '--force')
        peaks.append(peak_of(*words, environment=at_once))
    assert peaks[1] < 200, peaks  # MB
    assert peaks[1] - peaks[0] < 5, peaks  # 99,000 samples of two legs are 11 MB
