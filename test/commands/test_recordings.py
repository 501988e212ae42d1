"""Recordings of every kind: CSV dialects, logs of YARP, several parts, several topics of a bag."""

import csv
import io
from pathlib import Path

from icub_leg_fk import load_chain
from icub_leg_fk.stream.cdr import JointStateEncoder
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main

LEFT = load_chain('left_leg')
RIGHT = load_chain('right_leg')
HEAD = load_chain('head_imu', 'v2')
SINCE_1970 = 1_700_000_000  # s
COUNT = 20
TIMES = np.arange(COUNT) / 50  # s
POSITIONS = 0.06 * np.sin(np.arange(COUNT)[:, None] / 5 + np.arange(6))


def number_in(cell):
    return float(cell or 'nan')


def table_of(out):
    """Return the columns of a table that `leg_fk poses` printed."""
    header, *rows = csv.reader(io.StringIO(out))
    columns = [list(map(number_in, column)) for column in zip(*rows)]
    return dict(zip(header, np.array(columns)))


def poses(*words):
    """Return what `leg_fk poses` printed, as columns, and the lines on stderr."""
    done = run_main('poses', *words)
    assert done.returncode == 0, done.stderr
    return table_of(done.stdout), done.stderr


def assert_poses_of(table, chain, positions, times=TIMES):
    """Check the poses of a chain against the product of its matrices, and when they are."""
    assert np.allclose(table['time'] - table['time'][0], times - times[0], atol=1e-6)
    T = chain.forward(positions)
    for i, name in enumerate('xyz'):
        assert np.allclose(table[f'{chain.tip}_{name}'], T[:, i, 3], rtol=0, atol=1e-6)


JOINTS = LEFT.joint_names
SECONDS = [f'{time:.2f}' for time in TIMES]


def written(
    time='time',
    times=SECONDS,
    forms=('{}',),
    positions=POSITIONS,
    delimiter=',',
    point='.',
):
    """Return a CSV text: names as they are formed of those of the joints, and numbers."""
    rows = [[time, *(form.format(joint) for joint in JOINTS for form in forms)]]
    for at, q in zip(times, positions):
        rows.append([cell.replace('.', point) for cell in (at, *map(repr, q.tolist()))])
    return '\n'.join(map(delimiter.join, rows)) + '\n'


def since_1970(per_second):
    ms = [round((SINCE_1970 + time) * 1000) for time in TIMES.tolist()]
    return [str(time * per_second // 1000) for time in ms]


DIALECTS = {
    'plain.csv': written(),
    'commas.csv': written(delimiter=';', point=','),
    'tabs.tsv': written('Time', delimiter='\t'),
    'numpy.txt': '# ' + written('t', delimiter=' '),
    'blanks.txt': written(delimiter='   '),
    'windows.csv': written().encode('utf-16'),
    'excel.csv': b'\xef\xbb\xbf'
    + f'sep=;\n{written(delimiter=";", point=",")}'.replace('\n', '\r\n').encode(),
    'plotjuggler.csv': written(
        '__time',
        [f'{SINCE_1970 + time:.6f}' for time in TIMES],
        ('/joint_states/{}/position', '/joint_states/{}/velocity'),
        np.repeat(POSITIONS, 2, axis=1) * ([1, -9] * 6),
    ),
    'nanoseconds.csv': written('timestamp', since_1970(1_000_000_000)),
    'microseconds.csv': written('timestamp', since_1970(1_000_000)),
    'milliseconds.csv': written('stamp', since_1970(1000)),
    'floats.csv': written(
        times=['1.7000e+09', *(repr(SINCE_1970 + t) for t in TIMES[1:].tolist())]
    ),
    'units.csv': written('time [s]', forms=('{} [rad]',)),
    'degrees.csv': written(
        'time_ms',
        [f'{1000 * time:.0f}' for time in TIMES],
        ('{} [deg]',),
        np.degrees(POSITIONS),
    ),
    'words.csv': '\n'
    + written(
        '"note","time"',
        [f'"a, b",{time}' for time in SECONDS],
        ('joint_states.position.{}',),
    ),
}


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize('name', DIALECTS)
def test_every_dialect_of_csv_is_the_same_recording(name):
    text = DIALECTS[name]
    Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    table, errors = poses(name, '--chains', 'left_leg')
    assert_poses_of(table, LEFT, POSITIONS)
    assert errors == ''
    done = run_main('plot', name, '-o', 'x.svg')
    assert f'{COUNT} poses of left_foot' in done.stdout


def test_times_since_1970_are_kept_to_the_nanosecond():
    for name, time, shown in (
        ('time', '1700000000.123456789', '1700000000.123456789,'),
        ('timestamp', '1700000000123456789', '1700000000.123456789,'),
        ('time', '-0.5', '-0.500000000,'),
    ):
        Path('a.csv').write_text(written(name, [time]))
        done = run_main('poses', 'a.csv', '--chains', 'left_leg')
        assert done.stdout.splitlines()[1].startswith(shown)


@pytest.mark.parametrize('gap', ['', 'NaN', 'null'])
def test_empty_cells_and_nan_are_gaps(gap):
    lines = written().splitlines()
    lines[6] = f'0.10,0,0,0,{gap},0,0'
    lines[11] = ','.join(['0.20', *[gap] * 6])
    Path('gaps.csv').write_text('\n'.join(lines))
    table, errors = poses('gaps.csv', '--chains', 'left_leg')
    keep = [row for row in range(COUNT) if row not in (5, 10)]
    assert_poses_of(table, LEFT, POSITIONS[keep], TIMES[keep])
    assert 'left_leg: no pose from 1 message: l_knee nan' in errors


def test_legs_in_rows_of_their_own_are_no_gaps():
    none = [''] * 6
    rows = [['time', *JOINTS, *RIGHT.joint_names]]
    for time, q in zip(TIMES.tolist(), POSITIONS):
        rows += [[time, *q, *none], [time + 0.001, *none, *q]]
    with open('legs.csv', 'w', newline='') as stream:
        csv.writer(stream).writerows(rows)
    table, errors = poses('legs.csv')
    assert errors == ''
    assert np.isnan(table['right_foot_x'][::2]).all()
    left = {name: column[::2] for name, column in table.items()}
    assert_poses_of(left, LEFT, POSITIONS)


def test_times_in_an_unlikely_unit_are_warned_of():
    Path('ms.csv').write_text(written(times=[f'{1000 * time:.0f}' for time in TIMES]))
    table, errors = poses('ms.csv', '--chains', 'left_leg')
    assert 'taken as s, are 20 s apart; --time-unit says' in errors
    table, errors = poses('ms.csv', '--chains', 'left_leg', '--time-unit', 'ms')
    assert errors == ''
    assert_poses_of(table, LEFT, POSITIONS)


def test_a_recording_of_one_leg_says_how_to_leave_the_other_out():
    Path('left.csv').write_text(written())
    table, errors = poses('left.csv')
    assert_poses_of(table, LEFT, POSITIONS)
    assert np.isnan(table['right_foot_x']).all()
    assert errors.count('\n') == 1
    assert (
        'right_leg has no pose: no message has one of its joints (r_hip_pitch' in errors
    )
    assert '--chains left_leg leaves it out' in errors


HEADER = ','.join(('time', *JOINTS))
ROW = '0,0,0,0,0,0,0'
CSV_FAULTS = {  # lines of a file, and what is said of them
    '': 'bad.csv:1: no header',
    HEADER: 'no rows; allowed: at least one',
    'time,l_knee\n0,0': 'bad.csv:1: column l_hip_pitch, l_hip_roll, l_hip_yaw, l_ankle_p',
    'time,arm\n0,0': 'column l_hip_pitch',
    'a,b\n0,0': 'bad.csv:1: no column of times in the header (a, b); allowed: time, timest',
    'time,time,l_knee\n0,0,0': 'column time appears twice',
    f'{HEADER},l_knee\n{ROW},0': 'bad.csv:1: column l_knee appears twice',
    f'{HEADER.replace("l_knee", "/a/l_knee/position,/b/l_knee/position")}\n{ROW},0': (
        'column /a/l_knee/position and /b/l_knee/position'
    ),
    f'{HEADER}\n9e18,0,0,0,0,0,0': 'times before 2038',
    f'{HEADER}\n0,1_0,0,0,0,0,0': "column l_hip_pitch: '1_0'",
    f'{HEADER}\n{ROW}\n1,0,0,soon,0,0,0': "bad.csv:3: column l_hip_yaw: 'soon'",
    f'{HEADER}\n{ROW}\nnan,0,0,0,0,0,0': "bad.csv:3: column time: 'nan'",
    f'{HEADER}\n0,0': 'bad.csv:2: 2 values under 7 columns',
    f'{HEADER}\n{ROW},1': 'bad.csv:2: 8 values under 7 columns',
    f'{HEADER}\n0,1e300,0,0,0,0,0': "l_hip_pitch: '1e300'; allowed: a finite number up to",
    '\xff\xfe\x00\x01' * 99: 'no column of times',
}


@pytest.mark.parametrize('text', CSV_FAULTS)
def test_what_is_wrong_with_a_csv_file_is_one_line(text):
    Path('bad.csv').write_text(text, encoding='latin-1')
    done = run_main('poses', 'bad.csv', '--chains', 'left_leg')
    assert_one_line_complaint(done, CSV_FAULTS[text])


def write_log(part, joints, clocks='tx', port='state', times=TIMES, name=None):
    """Write a directory as yarpdatadumper does, with positions in YARP's order [rad]."""
    folder = Path(name or part)
    folder.mkdir(parents=True)
    (folder / 'info.log').write_text(
        f'Type: Bottle;\nStamp: {clocks};\n[0.1] /icub/{part}/{port}:o [connected]\n'
    )
    lines = []
    for number, (time, q) in enumerate(zip(times, np.degrees(joints).tolist())):
        both = f'{SINCE_1970 + time:.6f}'
        if '+' in clocks:
            both += f' {SINCE_1970 + time + 0.2:.6f}'
        values = ' '.join(map(repr, [*q, 1.0, 2.0]))
        if port == 'stateExt':
            values = f'({values}) [ok] (0.0 0.0) [ok]'
        lines.append(f'{number} {both} {values}\n')
    (folder / 'data.log').write_text(''.join(lines))
    return folder


@pytest.mark.parametrize('port', ['state', 'stateExt'])
@pytest.mark.parametrize('clocks', ['tx', 'rx', 'tx+rx'])
def test_a_log_of_yarp_is_read_in_degrees_with_the_senders_times(port, clocks):
    write_log('left_leg', POSITIONS, clocks, port, name='dump/left')
    for path in ('dump/left', 'dump', 'dump/left/data.log'):
        table, errors = poses(path, '--chains', 'left_leg')
        assert table['time'][0] == SINCE_1970
        assert_poses_of(table, LEFT, POSITIONS)
        assert errors == ''


def test_parts_of_yarp_are_one_robot_with_the_torso_in_its_order():
    pitch, roll, yaw, *neck = 0.2 * POSITIONS.T
    write_log('torso', np.stack([yaw, roll, pitch], axis=1))
    write_log('head', np.stack(neck, axis=1), times=TIMES + 1e-4)
    table, errors = poses('torso', 'head', '--chains', 'head_imu=v2')
    assert 'torso_pitch never seen' in errors or 'neck_pitch never seen' in errors
    whole = {
        name: column[::2] for name, column in table.items()
    }  # as the head's messages come
    assert_poses_of(whole, HEAD, 0.2 * POSITIONS, TIMES)
    done = run_main('plot', 'torso', 'head', '--chains', 'head_imu=v2', '-o', 'x.svg')
    assert done.returncode == 0


def test_parts_that_are_not_known_are_left_out_with_a_note():
    write_log('left_leg', POSITIONS, name='dump/left_leg')
    write_log('face', POSITIONS, name='dump/face')
    table, errors = poses('dump', '--chains', 'left_leg')
    assert_poses_of(table, LEFT, POSITIONS)
    assert errors == (
        'leg_fk: note: left out: /icub/face/state:o, of which no joint is known\n'
    )


def test_parts_that_do_not_go_together_are_refused_by_name():
    write_log('left_leg', POSITIONS)
    write_log('left_leg', POSITIONS, name='again')
    write_log('right_leg', POSITIONS, times=TIMES + 100)
    write_log('left_arm', POSITIONS)
    for paths, words in (
        ('left_leg again', 'again: brings joint l_hip_pitch, and so does left_leg'),
        ('left_leg right_leg', 'right_leg: begins at 1700000100.000 s, and left_leg'),
        ('left_arm', '/icub/left_arm/state:o is of no known part; allowed: left_leg'),
    ):
        assert_one_line_complaint(run_main('poses', *paths.split()), words)


@pytest.mark.parametrize(
    ('file', 'text', 'words'),
    [
        ('info.log', 'Type: Bottle;\n', 'info.log: names no port'),
        ('data.log', '', 'data.log: no lines'),
        ('data.log', '0 1.0 1 2 3\n', 'data.log:1: 3 values; allowed: 6 or more'),
        ('data.log', '0 soon 1 2 3 4 5 6\n', "data.log:1: time 'soon'"),
        ('data.log', '0 1.0 1 2 3 4 5 six\n', "data.log:1: value 'six'"),
        ('data.log', '0\n', 'data.log:1: ends too early'),
    ],
)
def test_what_is_wrong_with_a_log_is_one_line(file, text, words):
    folder = write_log('left_leg', POSITIONS)
    (folder / file).write_text(text)
    assert_one_line_complaint(run_main('poses', 'left_leg'), words)


def test_the_last_line_of_a_log_may_still_be_written():
    folder = write_log('left_leg', POSITIONS)
    with (folder / 'data.log').open('a') as stream:
        stream.write('20 17000')
    table, _ = poses('left_leg', '--chains', 'left_leg')
    assert_poses_of(table, LEFT, POSITIONS)


def test_other_files_are_refused_with_what_is_allowed():
    for name, words in (
        ('a.mat', 'is a file of MATLAB, as robometry writes it; save it as a CSV file'),
        ('robot.urdf', 'is no recording by its name; allowed: a bag'),
        ('nothing', 'there is no such file or directory; allowed: a bag'),
    ):
        if name != 'nothing':
            Path(name).write_text('text')
        for command in (('poses', name), ('plot', name), ('bag', name, 'out')):
            assert_one_line_complaint(run_main(*command), words)


def test_joint_states_are_serialized_as_ros_does():
    bag_files = pytest.importorskip('support.bag_files')
    names = ('a', 'l_knee', 'sieben', '\N{DEGREE SIGN}')
    stamp = SINCE_1970 * 10**9 + 7
    ours = JointStateEncoder(names).encode(stamp, [1.0, 2.0, 3.0, 4.0])
    assert ours == bag_files.joint_state(stamp, names, [1.0, 2.0, 3.0, 4.0])


def two_topics():
    """Write a bag with a topic of joint states for each leg, and one for another robot's arm."""
    bag_files = pytest.importorskip('support.bag_files')
    topics = {}
    for part, names in (
        ('left', JOINTS),
        ('right', RIGHT.joint_names),
        ('arm', ('arm',)),
    ):
        messages = []
        for time, q in zip(TIMES, POSITIONS):
            stamp = round((SINCE_1970 + time) * 1e9)
            data = bag_files.joint_state(stamp, names, q[: len(names)])
            messages.append((stamp, data))
        topics[f'/icub1/{part}/joint_states'] = (bag_files.JOINT_STATE, [], messages)
    return bag_files.write_topics('bag', topics)


def test_several_topics_of_a_bag_are_one_robot():
    bag = two_topics()
    topics = ('--joint-topic', '/icub1/left/joint_states', '/icub1/right/joint_states')
    table, errors = poses(bag, *topics)
    assert errors == ''
    assert len(table['time']) == COUNT  # messages of one time are one row
    for chain in (LEFT, RIGHT):
        assert_poses_of(table, chain, POSITIONS)
    for words, namespace in (((), '/icub1'), (('--namespace', 'a/b'), '/a/b')):
        done = run_main('bag', bag, 'out', *topics, *words, '--force')
        for tip in ('left_foot', 'right_foot'):
            added = f'{COUNT}  added on {namespace}/foot_pose_publisher/{tip}/pose'
            assert added in done.stdout
    assert_one_line_complaint(
        run_main('bag', bag, 'none', *topics, '--namespace', '1 2'),
        "--namespace: found '1 2'",
    )


def test_errors_name_the_topics_that_have_the_joints():
    bag = two_topics()
    has = (
        '--joint-topic can be /icub1/left/joint_states, /icub1/right/joint_states (which has '
        'joints of these chains), /icub1/arm/joint_states'
    )
    for command in (('poses', bag), ('plot', bag), ('bag', bag, 'out')):
        assert_one_line_complaint(
            run_main(*command), f'no joint states on /joint_states; {has}'
        )
    done = run_main('poses', bag, '--joint-topic', '/icub1/arm/joint_states')
    assert_one_line_complaint(done, '--joint-topic can be /icub1/left/joint_states')
    _, errors = poses(bag, '--joint-topic', '/icub1/left/joint_states')
    assert 'right_leg has no pose' in errors
    assert '--joint-topic can be /icub1/right/joint_states' in errors
    Path('walk.csv').write_text(DIALECTS['plain.csv'])
    done = run_main('poses', 'walk.csv', '--joint-topic', '/a')
    assert_one_line_complaint(done, '--joint-topic: walk.csv has no topics')


def test_bag_makes_a_bag_of_any_recording():
    bag_files = pytest.importorskip('support.bag_files')
    Path('walk.csv').write_text(DIALECTS['nanoseconds.csv'])
    write_log('left_leg', POSITIONS)
    left = ('--chains', 'left_leg')
    for source in ('walk.csv', 'left_leg'):
        done = run_main('bag', source, f'{source}_bag', *left)
        assert f'{COUNT}  messages copied' in done.stdout
        topics, messages = bag_files.read_bag(f'{source}_bag')
        assert topics['/joint_states'][0] == bag_files.JOINT_STATE
        assert len(bag_files.poses_of(messages, bag_files.LEFT_POSE)) == COUNT
        assert_poses_of(poses(f'{source}_bag', *left)[0], LEFT, POSITIONS)
