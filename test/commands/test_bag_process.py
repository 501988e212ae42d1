"""`leg_fk bag` as a command: whole or nothing, wrong words, many bags, memory, the terminal."""

import os
from pathlib import Path
import pty
import re
import shlex
import shutil
import signal
import subprocess
import time

import pytest
from support.bag_files import entries, read_bag, SECOND, walk, write_bag
from support.leg_fk_process import (
    assert_one_line_complaint,
    COMMAND,
    peak_of,
    run_code,
    run_main,
)

DEADLINE = 60.0  # s


def wait_for(condition, process=None):
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert process is None or process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.001)


def start(*words, stderr=subprocess.PIPE):
    return subprocess.Popen(
        [*COMMAND, 'bag', *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
    )


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope='module')
def long_bag(tmp_path_factory):
    """Return a bag that takes more than a second."""
    folder = tmp_path_factory.mktemp('long')
    return write_bag(folder / 'long', joints=walk(1500) * 40, others=False)


@pytest.fixture
def source():
    return write_bag('in', joints=walk(5))


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize('words', [(), ('--force',)])
def test_a_stopped_run_leaves_nothing(long_bag, number, words):
    if words:
        write_bag('out', joints=walk(3))
    before = [read_bag(path) for path in Path().iterdir()]
    process = start(long_bag, 'out', *words)

    def is_working():
        files = Path().glob('.out.*.part/out/*')
        return any(path.stat().st_size > 100_000 for path in files)

    wait_for(is_working, process)
    process.send_signal(number)
    assert process.communicate(timeout=DEADLINE) == ('', '')
    assert process.returncode == 128 + number
    assert [read_bag(path) for path in Path().iterdir()] == before


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_full_disk_is_one_line_and_leaves_nothing(long_bag, storage):
    """RLIMIT_FSIZE stands in for the disk: what is written beyond it fails."""
    code = (
        'import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); '
        'resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000)); '
        'from icub_leg_fk.__main__ import main; sys.exit(main())'
    )
    done = run_code(code, 'bag', long_bag, 'out', '--storage', storage)
    assert_one_line_complaint(done, 'out')
    assert entries('.') == []


def test_an_existing_bag_is_replaced_only_with_force(source):
    for name in ('out', 'out.mcap'):
        assert run_main('bag', source, name).returncode == 0
        old = read_bag(name)
        assert_one_line_complaint(
            run_main('bag', source, name),
            f'{name}: exists already; --force replaces it',
        )
        assert read_bag(name) == old
        run_main('bag', source, name, '--force', '--chains', 'left_leg')
        assert read_bag(name) != old
    assert entries('.') == ['in', 'out', 'out.mcap']


def test_force_replaces_nothing_but_bags(source):
    for folder in ('precious/more', 'empty', 'shelf', 'folder/metadata.yaml', 'own'):
        Path(folder).mkdir(parents=True)
    Path('link').symlink_to('precious')
    shutil.copytree(source, 'shelf/monday.mcap')  # two recordings on a shelf
    shutil.copyfile(source / 'in.mcap', 'shelf/tuesday.mcap')
    for name in ('annotated', 'linked'):
        shutil.copytree(source, name)
    Path('linked/in.mcap').rename('elsewhere.mcap')
    Path('linked/in.mcap').symlink_to('../elsewhere.mcap')
    for file in (
        'precious/walk.mcap',
        'notes.txt',
        'annotated/in.mcap.notes.txt',
        'own/metadata.yaml',
    ):
        Path(file).write_text('my: notes')
    before = sorted(Path().rglob('*'))
    for path in sorted(Path().iterdir()):
        if path.name not in ('in', 'elsewhere.mcap'):
            assert_one_line_complaint(
                run_main('bag', source, path, '--force'),
                'exists already and is something else',
            )
    assert sorted(Path().rglob('*')) == before


def test_the_input_is_never_the_output(source):
    before = read_bag(source)
    Path('link').symlink_to('in')
    for words in (
        'in in',
        'in link',
        'link in',
        'in in/out',
        'in/in.mcap in',
        'in/in.mcap in/in.mcap',
        'in in/../in/',
    ):
        assert_one_line_complaint(
            run_main('bag', *words.split(), '--force'), 'is the input itself'
        )
    assert read_bag(source) == before
    assert entries('.') == ['in', 'link']


WRONG = {  # words of a command, and of its answer
    'in': '1 bag without --out-dir; allowed: two',
    'in a b': '3 bags without --out-dir; allowed: two',
    'notes.txt out': 'notes.txt:1: no column of times in the header (notes)',
    'loop out': 'loop: is a loop of links',
    "'' out": "argument BAG: found '', allowed: a path",
    'in -': '-: is standard output',
    'in --out-dir=-out': '-out: begins with a minus sign',
    'in out --chains left_arm': "--chains: unknown chain 'left_arm'; ",
    'in out --chains left_leg left_leg': '--chains: chain left_leg is named twice',
    'in out --chains left_leg=v9': "unknown version 'v9' of chain left_leg",
    'in out --version v9': "--version: unknown version 'v9' of chain left_leg",
    'in out --joint-timeout 1e300': '--joint-timeout: found 1e+300, allowed: 0 to',
    'in out --joint-timeout -1': '--joint-timeout: found -1.0',
    'in out --joint-timeout nan': '--joint-timeout: found nan',
    'in out --foot-frame toe': "--foot-frame: found 'toe', allowed: dh or sole",
    "in out --frame-prefix 'a b'": "--frame-prefix: found 'a b'",
    'in out --frame-prefix /icub1/': "--frame-prefix: found '/icub1/'",
    'in out --joint-topic /text': '--joint-topic can be /joint_states',
    'in out --storage rosbag1': "invalid choice: 'rosbag1'",
    'in out.db3 --storage mcap': 'is a name for sqlite3, and --storage is mcap',
    'in in --out-dir out': 'several bags would get this name',
    'in --out-dir out --jobs 0': "argument --jobs: found '0', allowed: integers",
    'in notes.txt/out': 'there is no directory',
    'in new/out': 'there is no directory',
    'in /': 'is the input itself',
    f'in {"o" * 250}': 'file name too long',
}


@pytest.mark.parametrize('words', WRONG)
def test_wrong_words_are_one_line(source, words):
    Path('notes.txt').write_text('notes')
    Path('loop').symlink_to('loop')
    assert_one_line_complaint(run_main('bag', *shlex.split(words)), WRONG[words])
    assert {*entries('.')} - {'out'} == {'in', 'loop', 'notes.txt'}


def test_many_bags_side_by_side():
    sources = [write_bag(f'walk{i}', joints=walk(100 + i)) for i in range(3)]
    sources.append(write_bag('x', 'sqlite3', joints=walk(9)) / 'x.db3')
    for jobs in (1, 2):
        out = Path(f'out{jobs}')
        done = run_main('bag', *sources, '--out-dir', out, '--jobs', jobs)
        assert (done.returncode, done.stderr) == (0, '')
        assert entries(out) == ['walk0', 'walk1', 'walk2', 'x.db3']
        for source in sources:
            assert f'{source} -> {out / source.name}\n' in done.stdout
            alone = f'alone_{source.name}'
            run_main('bag', source, alone, '--force')
            assert read_bag(out / source.name) == read_bag(alone)


@pytest.mark.parametrize('jobs', [1, 2])
def test_one_bad_bag_does_not_stop_the_others(jobs):
    for name, count in (('a', 5), ('b', 0), ('c', 5)):
        write_bag(name, joints=walk(count))
    words = ('bag', 'a', 'b', 'c', '--out-dir', 'out')
    done = run_main(*words, '--jobs', jobs)
    assert done.returncode == 2
    assert re.fullmatch(
        r'leg_fk: error: b: no message of joint states.*\n', done.stderr
    )
    assert entries('out') == ['a', 'c']
    done = run_main(*words, '--version', 'v9')
    assert re.fullmatch(
        r'(leg_fk: error: [abc]: --version: unknown .*\n){3}', done.stderr
    )


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_stopped_jobs_leave_nothing(long_bag, number):
    Path('other').symlink_to(long_bag)
    process = start(long_bag, 'other', '--out-dir', 'out', '--jobs', 2)
    wait_for(lambda: len(list(Path('out').glob('.*.part/*/*'))) == 2, process)
    process.send_signal(number)
    assert process.communicate(timeout=DEADLINE) == ('', '')
    wait_for(lambda: entries('out') == [])


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_memory_does_not_grow_with_the_bag(storage):
    """Peak resident size of the process, for a bag and one of five times its size."""
    walked = walk(1500)  # 15 s, again and again
    peaks = []
    for times in (6, 30):
        joints = [
            (time + 15 * SECOND * i, data)
            for i in range(times)
            for time, data in walked
        ]
        write_bag(f'in_{times}', storage, joints, others=False)
        peaks.append(peak_of('bag', f'in_{times}', f'out_{times}'))
    assert peaks[1] < peaks[0] + 3, peaks  # MB
    assert peaks[1] < 110, peaks


def test_a_terminal_shows_progress_and_nothing_else_does(long_bag, monkeypatch):
    monkeypatch.setenv('TERM', 'xterm')
    monkeypatch.setenv('COLUMNS', '80')
    master, slave = pty.openpty()
    process = start(long_bag, 'out', stderr=slave)
    os.close(slave)
    shown = read_to_end(master)
    output, _ = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0
    shares = [int(share) for share in re.findall(r' (\d+) %', shown)]
    assert len(set(shares)) >= 2
    assert shares == sorted(shares)
    assert shares[-1] <= 100
    assert 'long' in shown
    assert shown.endswith('\x1b[2K')  # the line is empty again
    assert '\r' not in output and '\x1b' not in output
    assert re.search(
        r'\n  14\.\d+ s of recording in .* seconds of recording per second\n', output
    )


def read_to_end(terminal):
    """Return all that a terminal shows until nobody writes to it."""
    shown = b''
    while True:
        try:
            shown += os.read(terminal, 4096)
        except OSError:  # the other end is closed
            os.close(terminal)
            return shown.decode()
