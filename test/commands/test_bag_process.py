"""`leg_fk bag` as a process: whole or nothing, wrong words, many bags, memory, the terminal."""

import os
from pathlib import Path
import pty
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest
from support.bag_files import entries, read_bag, walk, write_bag
from support.leg_fk_process import assert_one_line_complaint, COMMAND, leg_fk

DEADLINE = 60.0  # s


def wait_for(condition, process):
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.001)


@pytest.fixture(scope='module')
def long_bag(tmp_path_factory):
    """Return a bag that takes about a second."""
    folder = tmp_path_factory.mktemp('long')
    return write_bag(folder / 'long', joints=walk(1500) * 20, others=False)


def is_working(folder):
    """Return a condition that a bag is being written in a folder, and has some messages."""
    def condition():
        return any(path.stat().st_size > 100_000 for path in folder.glob('.out.*.part/out/*'))
    return condition


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize('force', [False, True])
def test_a_stopped_run_leaves_nothing(tmp_path, long_bag, number, force):
    if force:
        write_bag(tmp_path / 'out', joints=walk(3))
        before = read_bag(tmp_path / 'out')
    process = subprocess.Popen([*COMMAND, 'bag', long_bag, tmp_path / 'out',
                                *(['--force'] if force else [])],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(is_working(tmp_path), process)
    process.send_signal(number)
    output = process.communicate(timeout=DEADLINE)
    assert process.returncode == 128 + number
    assert output == ('', '')
    assert entries(tmp_path) == (['out'] if force else [])
    if force:
        assert read_bag(tmp_path / 'out') == before


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, long_bag):
    """RLIMIT_FSIZE stands in for the disk: what is written beyond it fails."""
    for storage in ('mcap', 'sqlite3'):
        code = ('import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); '
                'resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000)); '
                'from icub_leg_fk.__main__ import main; sys.exit(main())')
        done = subprocess.run(
            [sys.executable, '-c', code, 'bag', long_bag, tmp_path / 'out', '--storage', storage],
            capture_output=True, text=True, timeout=DEADLINE)
        assert (done.returncode, done.stdout) == (2, ''), done
        assert done.stderr.startswith('leg_fk: error: ') and done.stderr.count('\n') == 1
        assert entries(tmp_path) == []


def test_an_existing_bag_is_replaced_only_with_force(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    for name in ('out', 'out.mcap'):
        assert leg_fk('bag', source, tmp_path / name).returncode == 0
        old = read_bag(tmp_path / name)
        assert_one_line_complaint(leg_fk('bag', source, tmp_path / name),
                                  f'{name}: exists already; --force replaces it')
        assert read_bag(tmp_path / name) == old
        done = leg_fk('bag', source, tmp_path / name, '--force', '--chains', 'left_leg')
        assert done.returncode == 0, done
        assert read_bag(tmp_path / name) != old
    assert entries(tmp_path) == ['in', 'out', 'out.mcap']


def test_force_replaces_nothing_but_bags(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    precious = tmp_path / 'precious'
    (precious / 'more').mkdir(parents=True)
    (precious / 'walk.mcap').write_text('a bag')
    (tmp_path / 'notes.txt').write_text('notes')
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'link').symlink_to(precious)
    shelf = tmp_path / 'shelf'  # two recordings, each in its folder or file
    shutil.copytree(source, shelf / 'monday.mcap')
    shutil.copyfile(source / 'in.mcap', shelf / 'tuesday.mcap')
    annotated = shutil.copytree(source, tmp_path / 'annotated')
    (annotated / 'in.mcap.notes.txt').write_text('notes')
    linked = shutil.copytree(source, tmp_path / 'linked')
    (linked / 'in.mcap').rename(tmp_path / 'elsewhere.mcap')
    (linked / 'in.mcap').symlink_to(tmp_path / 'elsewhere.mcap')
    (tmp_path / 'folder' / 'metadata.yaml').mkdir(parents=True)
    (tmp_path / 'own').mkdir()
    (tmp_path / 'own' / 'metadata.yaml').write_text('my: notes')
    before = sorted(tmp_path.rglob('*'))
    for name in ('precious', 'notes.txt', 'empty', 'link', 'shelf', 'annotated', 'linked',
                 'folder', 'own'):
        assert_one_line_complaint(leg_fk('bag', source, tmp_path / name, '--force'),
                                  'exists already and is something else')
    assert sorted(tmp_path.rglob('*')) == before
    assert (precious / 'walk.mcap').read_text() == 'a bag'


def test_the_input_is_never_the_output(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    before = read_bag(source)
    (tmp_path / 'link').symlink_to(source)
    for words in (('in', 'in'), ('in', 'link'), ('link', 'in'), ('in', 'in/out'),
                  ('in/in.mcap', 'in'), ('in/in.mcap', 'in/in.mcap'), ('in', 'in/../in/')):
        paths = [tmp_path / word for word in words]
        assert_one_line_complaint(leg_fk('bag', *paths, '--force'), 'is the input itself')
    assert read_bag(source) == before
    assert entries(tmp_path) == ['in', 'link']


@pytest.mark.parametrize(('words', 'complaint'), [
    (['in'], '1 bag without --out-dir; allowed: two'),
    (['in', 'a', 'b'], '3 bags without --out-dir; allowed: two'),
    (['notes.txt', 'out'], "format '.txt'; allowed: a rosbag2 directory, or a .mcap or .db3"),
    (['in', 'out', '--chains', 'left_arm'], "unknown chain 'left_arm'; known: left_leg"),
    (['in', 'out', '--chains', 'left_leg', 'left_leg'], '--chains: found'),
    (['in', 'out', '--version', 'v9'], "unknown version of chain left_leg 'v9'; did you mean"),
    (['in', 'out', '--chain-version', 'left_leg'], 'allowed: CHAIN=VERSION'),
    (['in', 'out', '--chain-version', 'left_leg='], 'allowed: CHAIN=VERSION'),
    (['in', 'out', '--chain-version', 'head_imu=v2'],
     'found head_imu, allowed: left_leg, right_leg'),
    (['in', 'out', '--chain-version', 'left_leg=v1', '--chain-version', 'left_leg=v3'],
     'found left_leg again, allowed: left_leg, right_leg, each once'),
    (['in', 'out', '--joint-timeout', '1e300'], '--joint-timeout: found 1e+300, allowed: 0 to'),
    (['in', 'out', '--chain-version', 'left_leg=v9'], '--chain-version left_leg: found'),
    (['in', 'out', '--chains', 'head_imu'], '(or --chain-version head_imu=VERSION)'),
    (['in', 'out', '--foot-frame', 'toe'], "--foot-frame: found 'toe', allowed: dh or sole"),
    (['in', 'out', '--frame-prefix', 'a b'], "--frame-prefix: found 'a b'"),
    (['in', 'out', '--joint-timeout', '-1'], '--joint-timeout: found -1.0'),
    (['in', 'out', '--joint-timeout', 'nan'], '--joint-timeout: found nan'),
    (['in', 'out', '--joint-topic', '/text'], '--joint-topic can be /joint_states'),
    (['in', 'out', '--storage', 'rosbag1'], "invalid choice: 'rosbag1'"),
    (['in', 'out.db3', '--storage', 'mcap'], 'is a name for sqlite3, and --storage is mcap'),
    (['in', 'in', '--out-dir', 'out'], 'several bags would get this name'),
    (['in', '--out-dir', 'out', '--jobs', '0'], "argument --jobs: found '0', allowed: integers"),
    (['in', 'notes.txt/out'], 'there is no directory'),
    (['in', 'new/out'], 'there is no directory'),
    (['in', '/'], 'is the input itself'),
    (['in', 'out', '--frame-prefix', '/icub1/'], "--frame-prefix: found '/icub1/'"),
    (['in', 'o' * 250], 'File name too long'),
])
def test_wrong_words_are_one_line(tmp_path, monkeypatch, words, complaint):
    monkeypatch.chdir(tmp_path)
    write_bag(Path('in'), joints=walk(5))
    Path('notes.txt').write_text('notes')
    Path('empty').mkdir()
    monkeypatch.setenv('PYTHONPATH', str(Path(__file__).resolve().parents[2]))
    assert_one_line_complaint(leg_fk('bag', *words), complaint)
    assert [name for name in entries(tmp_path) if name != 'out'] == ['empty', 'in', 'notes.txt']


def test_many_bags_side_by_side(tmp_path):
    for number in range(3):
        write_bag(tmp_path / f'walk{number}', joints=walk(100 + number))
    bare = write_bag(tmp_path / 'x', 'sqlite3', joints=walk(9)) / 'x.db3'
    sources = [*(tmp_path / f'walk{number}' for number in range(3)), bare]
    for jobs in (1, 2):
        out = tmp_path / f'out{jobs}'
        done = leg_fk('bag', *sources, '--out-dir', out, '--jobs', jobs)
        assert (done.returncode, done.stderr) == (0, ''), done
        assert entries(out) == ['walk0', 'walk1', 'walk2', 'x.db3']
        for source in sources:
            assert f'{source} -> {out / source.name}\n' in done.stdout
    for source in sources:
        alone = tmp_path / f'alone_{source.name}'
        leg_fk('bag', source, alone)
        expected = read_bag(alone)
        assert read_bag(tmp_path / 'out1' / source.name) == expected
        assert read_bag(tmp_path / 'out2' / source.name) == expected


@pytest.mark.parametrize('jobs', [1, 2])
def test_one_bad_bag_does_not_stop_the_others(tmp_path, jobs):
    write_bag(tmp_path / 'a', joints=walk(5))
    write_bag(tmp_path / 'b', joints=[])
    write_bag(tmp_path / 'c', joints=walk(5))
    done = leg_fk('bag', *(tmp_path / name for name in 'abc'), '--out-dir', tmp_path / 'out',
                  '--jobs', jobs)
    assert done.returncode == 2
    assert re.fullmatch(r'leg_fk: error: .*/b: no message of joint states.*\n',
                        done.stderr)
    assert entries(tmp_path / 'out') == ['a', 'c']


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_stopped_jobs_leave_nothing(tmp_path, long_bag, number):
    (tmp_path / 'other').symlink_to(long_bag)
    out = tmp_path / 'out'
    process = subprocess.Popen([*COMMAND, 'bag', long_bag, tmp_path / 'other', '--out-dir', out,
                                '--jobs', '2'], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    wait_for(lambda: len(list(out.glob('.*.part/*/*'))) == 2, process)
    process.send_signal(number)
    _, errors = process.communicate(timeout=DEADLINE)
    assert errors == ''
    deadline = time.monotonic() + DEADLINE
    while entries(out) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert entries(out) == []


def test_memory_does_not_grow_with_the_bag(tmp_path):
    """Peak resident size of the process, for a bag and one of five times its size."""
    code = ('import sys; from icub_leg_fk.__main__ import main; status = main(); '
            'peak, = (line for line in open("/proc/self/status") if line.startswith("VmHWM")); '
            'print(peak.split()[1], file=sys.stderr); sys.exit(status)')
    walked = walk(1500)  # 15 s, again and again
    for storage in ('mcap', 'sqlite3'):
        peaks = []
        for times in (1, 5):
            joints = [(time + 15 * 10 ** 9 * i, data) for i in range(10 * times)
                      for time, data in walked]
            write_bag(tmp_path / f'{storage}{times}', storage, joints, others=False)
            done = subprocess.run(
                [sys.executable, '-c', code, 'bag', tmp_path / f'{storage}{times}',
                 tmp_path / f'{storage}{times}_out'],
                capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, done
            peaks.append(int(done.stderr) / 1000)
        assert peaks[1] < peaks[0] + 3, peaks  # MB
        assert peaks[1] < 110, peaks


def test_a_terminal_shows_a_bar_and_nothing_else_does(tmp_path, long_bag):
    master, slave = pty.openpty()
    process = subprocess.Popen([*COMMAND, 'bag', long_bag, tmp_path / 'out'],
                               stdout=subprocess.PIPE, stderr=slave, text=True)
    os.close(slave)
    output = process.communicate(timeout=DEADLINE)[0]
    assert process.returncode == 0
    shown = b''
    while True:
        try:
            piece = os.read(master, 4096)
        except OSError:  # the other end is closed
            break
        shown += piece
    os.close(master)
    shares = [int(share) for share in re.findall(rb'\r *(\d+) %', shown)]
    assert len(shares) >= 2 and shares == sorted(shares) and shares[-1] <= 100
    assert shown.endswith(b'\r\x1b[K')
    assert '\r' not in output and '\x1b' not in output
    assert re.search(r'\n  14\.\d+ s of recording in .* seconds of recording per second\n', output)
