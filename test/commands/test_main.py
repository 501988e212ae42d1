"""The `leg_fk` command as a whole: help, start-up, pipes, signals, mistakes, completion."""

import io
import os
from pathlib import Path
import resource
import shlex
import signal
import subprocess
import sys

import icub_leg_fk
from icub_leg_fk.__main__ import COMMANDS, main
from icub_leg_fk.kinematics import Catalog, config_file
import pytest
from support.leg_fk_process import COMMAND, leg_fk, run_main
from support.robots import joint, robot

ARM = config_file('examples/cylindrical_arm.yaml')
ZEROS = '0 0 0 0 0 0'

# What is typed, the exit status, and words of the answer on stderr, which is one line.
ANSWERS = [
    # Commands and options.
    ('help', 2, 'leg_fk -h explains them'),
    ('lsit', 2, "unknown command 'lsit'; did you mean 'list'? known: list, pose"),
    ("'po\nse'", 2, "unknown command 'po\\nse'"),
    ('--verison', 2, 'unknown option --verison; did you mean --version?'),
    ('--verbose', 2, 'unknown option --verbose (see leg_fk -h)'),
    ('-1', 2, "invalid choice: '-1'"),
    ('list --js', 2, 'unknown option --js; did you mean --json?'),
    ('list left_leg', 2, 'unrecognized arguments: left_leg'),
    ('pose left_leg --radian 0', 2, 'unknown option --radian; did you mean --radians?'),
    ('pose left_leg -degrees 0', 2, 'unknown option -degrees; did you mean --degrees?'),
    ('pose left_leg --deg=0', 2, 'unknown option --deg; did you mean --degrees?'),
    ('pose left_leg --frame sole', 2, 'did you mean --foot-frame?'),
    ('plot x.csv --ouput y', 2, 'did you mean --output?'),
    ('demo --colour', 2, 'unknown option --colour (see leg_fk demo -h)'),
    # Chains, versions and frames.
    (
        f'pose left_arm --degrees {ZEROS}',
        2,
        "'left_arm'; known: left_leg, right_leg, head_imu",
    ),
    (f'pose Left_Leg --degrees {ZEROS}', 2, "did you mean 'left_leg'?"),
    (f'pose left_foot --degrees {ZEROS}', 2, 'left_foot is the tip of left_leg'),
    (f'pose r_sole --degrees {ZEROS}', 2, 'r_sole is the sole frame of right_leg'),
    (
        f'pose left_leg --version V2_5 --degrees {ZEROS}',
        2,
        "'V2_5' of chain left_leg; did you mean 'v2_5'? known: v1, v2_5, v3",
    ),
    (f'pose left_leg=v9 --degrees {ZEROS}', 2, 'known: v1, v2_5, v3'),
    (
        f'pose left_leg --version "" --degrees {ZEROS}',
        2,
        'is empty; leave it out for its default',
    ),
    (f'pose left_leg --foot-frame toe --degrees {ZEROS}', 2, 'known: dh, sole'),
    (f'pose head_imu --foot-frame sole --degrees {ZEROS}', 2, 'known: dh'),
    (
        f'pose left_leg -k "" --degrees {ZEROS}',
        2,
        'is empty; leave it out for its default',
    ),
    (f'pose left_leg -k none.yaml --degrees {ZEROS}', 2, 'none.yaml'),
    ('list -k .', 2, 'cannot read .'),
    # Joint positions.
    ('pose left_leg', 2, 'one of the arguments --degrees --radians is required'),
    ('pose left_leg --degrees', 2, 'expected at least one argument'),
    ('pose left_leg --degrees 0 --radians 0', 2, 'not allowed with'),
    (
        'pose left_leg --degrees 0 0 0 0 0',
        2,
        'has 5 entries; allowed: 6, in the order l_hip_pitch l_hip',
    ),
    (f'pose left_leg --degrees {ZEROS} 0', 2, 'has 7 entries; allowed: 6'),
    ('pose left_leg --degrees 0 zero', 2, "found 'zero', allowed: finite numbers"),
    ('pose left_leg --degrees 0 nan', 2, "found 'nan', allowed: finite numbers"),
    ('pose left_leg --degrees 0 -inf', 2, "found '-inf', allowed: finite numbers"),
    ('pose left_leg --degrees 0 1e999', 2, "found '1e999', allowed: finite numbers"),
    ('pose left_leg --degrees 0 1e308', 2, 'allowed: finite numbers up to 1e+09'),
    ('pose left_leg --degrees 1_0', 2, "found '1_0'"),
    ('pose left_leg --degrees 10,-20,30', 2, 'numbers are separated by spaces'),
    ('pose left_leg --degrees -10,-20,30', 2, 'numbers are separated by spaces'),
    (
        f'pose --degrees {ZEROS} left_leg',
        2,
        "found 'left_leg', allowed: finite numbers",
    ),
    (
        'pose left_leg --radians 10 20 0 0 0 0',
        0,
        'look like degrees, for which there is --degrees: l_hip_pitch 10, l_hip_roll 20',
    ),
    # urdf.
    ('urdf elbow', 2, "unknown chain 'elbow'"),
    ('urdf left_foot', 2, 'left_foot is the tip of left_leg'),
    ('urdf left_leg left_leg', 2, 'named twice'),
    ('urdf left_leg left_leg=v1', 2, 'named twice'),
    ('urdf left_leg=v3 right_leg', 2, 'do not go together'),
    ('urdf --version v9', 2, "unknown version 'v9'; known: v1, v2_5, v3, v2"),
    ('urdf head_imu --version v9', 2, 'known: v2'),
    ('urdf -k no_such_file.yaml', 2, 'no_such_file.yaml'),
    ("urdf --name 'a\x01b'", 2, "--name is 'a\\x01b'; allowed: printable text"),
    ('urdf --name ""', 2, "--name is ''; allowed: printable text"),
    ('urdf left_leg -o -1', 2, 'begins with a minus sign'),
    ('urdf left_leg -o -1.urdf', 2, 'begins with a minus sign'),
    ('urdf left_leg -o -x.urdf', 2, 'unknown option -x.urdf'),
    ('urdf left_leg -o /dev/null', 2, '/dev/null'),
    ('urdf left_leg -o /no/such/folder/x.urdf', 2, 'there is no directory'),
    (
        'urdf left_leg -o /proc/x.urdf',
        2,
        '/proc/x.urdf: cannot be written: no such file',
    ),
    ('urdf left_leg -o ""', 2, "'': is not the name of a file"),
    ('urdf left_leg -o /', 2, "'/': is not the name of a file"),
    ('demo -o /proc/x.png', 2, '/proc/x.png: cannot be written: no such file'),
    ('demo -o ""', 2, 'is not the name of a file'),
    ('demo --save /proc/x', 2, '/proc/x: cannot be written: no such file'),
]

# Files that are not what is asked for.
FILES = {
    'empty': b' \n',
    'bytes': bytes(range(256)),
    'text.txt': b'left_leg',
    'arm.yaml': ARM.read_bytes(),
    'page.html': b'<!DOCTYPE html><html/>',
    'links.urdf': b'<robot name="r"><link name="base"/><link name="base2"/></robot>',
    'link.urdf': b'<robot name="r"><link name="base"/></robot>',
    'nothing.urdf': b'<robot name="r"/>',
    'utf16.urdf': '<robot name="r"><link name="base"/></robot>'.encode('utf-16'),
    'arm.urdf': robot([joint(0), joint(1)]).encode(),
    'arm.xacro': b'<robot xmlns:xacro="x"><xacro:include filename="f"/></robot>',
}

# What is typed, and words of the answer, whose exit status is 2.
ANSWERS_ON_FILES = [
    ('list -k empty', 'found nothing, allowed: units and chains'),
    ('list -k bytes', 'not printable UTF-8 text'),
    ('list -k text.txt', "found 'left_leg', allowed: a mapping with units"),
    ('list -k page.html', 'is not a URDF: its root is <html>'),
    ('list -k link.urdf', 'has no chain: no joint moves a link at its ends'),
    ('list -k links.urdf', 'has 2 links at the top (base, base2)'),
    ('list -k nothing.urdf', 'has no links'),
    ('list -k utf16.urdf', 'is UTF-16 text; allowed: UTF-8'),
    ('list -k arm.xacro', 'xacro arm.xacro > robot.urdf'),
    ('urdf -k link.urdf', 'has no chain'),
    ('list -k arm.urdf --root l9', "unknown link 'l9' of arm.urdf; "),
    ('list -k arm.urdf --root ""', '--root is empty; leave it out for its default'),
    (
        'pose l2 -k arm.urdf --root l1 --degrees 0 0',
        '2 entries; allowed: 1, in the order j1',
    ),
    ('explain l1 -k arm.urdf --root l1', "no joint moves between 'l1' and 'l1'"),
    ('pose left_leg -k arm.urdf --degrees 0', "unknown chain 'left_leg'; known: l2"),
    ('table empty', 'is empty'),
    ('table ""', "cannot read '': no such file"),
    ('table text.txt', 'it has no element'),
    ('table arm.yaml', 'is a kinematics file; allowed here: a URDF'),
    ('table link.urdf', 'has no chain'),
    ('table nothing.urdf', 'has no links'),
    ('table arm.urdf', "has none of the iCub's chains; give --tips, such as l2"),
    ('table arm.urdf --tips l9', "unknown chain 'l9'"),
    ('compare arm.yaml', 'is a kinematics file; allowed here: a URDF'),
    ('compare arm.urdf', '-k tables with the names of this robot'),
    ('compare arm.urdf --chains left_leg=v9', "unknown version 'v9' of chain left_leg"),
    ('compare arm.urdf --chains l_sole', 'l_sole is the sole frame of left_leg'),
]


@pytest.mark.parametrize(('typed', 'answer'), ANSWERS_ON_FILES)
def test_an_answer_on_a_wrong_file_is_one_line_that_helps(
    typed, answer, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        Path(name).write_bytes(content)
    done = run_main(*shlex.split(typed))
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith('leg_fk: error: ') and done.stderr.count('\n') == 1
    assert answer in done.stderr


@pytest.mark.parametrize(('typed', 'status', 'answer'), ANSWERS)
def test_an_answer_is_one_line_that_helps(typed, status, answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run_main(*shlex.split(typed))
    assert done.returncode == status
    assert done.stderr.startswith('leg_fk: ') and done.stderr.count('\n') == 1
    assert answer in done.stderr
    assert bool(done.stdout) == (status == 0)
    assert not list(tmp_path.iterdir())


def test_answers_are_as_good_in_the_c_locale(tmp_path):
    program = (
        'import shlex, sys; from icub_leg_fk.__main__ import main; '
        'print([main(shlex.split(typed)) for typed in sys.argv[1:]])'
    )
    rows = [row for row in ANSWERS if row[1] == 2]
    rows.append(('pose left_l\u00e9g --degrees 0', 2, 'unknown chain'))
    done = subprocess.run(
        [
            sys.executable,
            '-X',
            'utf8=0',
            '-c',
            program,
            *(typed for typed, _, _ in rows),
        ],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=60,
        env={**os.environ, 'LC_ALL': 'C', 'PYTHONCOERCECLOCALE': '0'},
    )
    assert done.stdout == f'{[status for _, status, _ in rows]}\n'
    lines = done.stderr.splitlines()
    for (_, _, answer), line in zip(rows, lines, strict=True):
        assert answer in line


def test_help_lists_every_command_with_one_line_and_examples():
    for words in ([], ['-h']):
        done = run_main(*words)
        assert (done.returncode, done.stderr) == (0, '')
        listed, _, examples = done.stdout.partition('examples:')
        for command, purpose in COMMANDS.items():
            assert f'\n    {command} ' in listed and purpose in ' '.join(listed.split())
            assert f'\n  leg_fk {command}' in examples


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_has_help_with_examples(command):
    done = run_main(command, '-h')
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.startswith(f'usage: leg_fk {command} ')
    assert f'\n  leg_fk {command}' in done.stdout.partition('examples:')[2]
    assert max(map(len, done.stdout.splitlines())) <= 100


def test_a_usage_line_works_as_typed():
    usage = run_main('pose', '-h').stdout.splitlines()[0]
    assert (
        usage
        == 'usage: leg_fk pose CHAIN (--degrees Q ... | --radians Q ...) [options]'
    )
    assert (
        run_main('pose', 'left_leg', '--degrees', *ZEROS.split(), '--json').returncode
        == 0
    )
    assert 'usage: leg_fk urdf [CHAIN ...] [options]' in run_main('urdf', '-h').stdout


def test_options_may_stand_anywhere():
    expected = run_main('urdf', 'left_leg', 'right_leg', '--version', 'v1')
    assert expected.returncode == 0 and 'right_leg v1' in expected.stdout
    for words in (
        'left_leg --version v1 right_leg',
        '--version v1 left_leg right_leg=v1',
    ):
        assert run_main('urdf', *words.split()).stdout == expected.stdout


def test_version_is_the_packages():
    assert run_main('--version').stdout == f'leg_fk {icub_leg_fk.__version__}\n'


def test_the_package_shows_its_api_and_nothing_else():
    assert dir(icub_leg_fk) == sorted(icub_leg_fk.__all__)
    for name in icub_leg_fk.__all__:
        assert getattr(icub_leg_fk, name).__module__.startswith('icub_leg_fk.')


def test_a_command_imports_its_own_module_and_no_optional_library():
    program = (
        'import sys; from icub_leg_fk.__main__ import main; main(["list"]); '
        "print(*sorted(sys.modules), sep='\\n', file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0
    modules = set(done.stderr.split())
    assert {'sympy', 'matplotlib', 'rosbags', 'rclpy', 'rich'}.isdisjoint(modules)
    commands = {module.removeprefix('icub_leg_fk.commands.') for module in modules}
    assert commands & {*COMMANDS} == {'list'}


def test_help_is_there_at_once():
    def cpu_seconds(
        *words,
    ):  # the machine may be busy, so the best of three, in CPU time
        runs = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(
                [sys.executable, *words], stdout=subprocess.DEVNULL, check=True
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            runs.append(
                after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            )
        return min(runs)

    assert cpu_seconds(*COMMAND[1:], '-h') < 2 * cpu_seconds('-c', 'import numpy, yaml')


@pytest.mark.parametrize('command', ['list', '-h'])
def test_a_reader_that_leaves_ends_the_command_quietly(command):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, 'w') as output:
        done = subprocess.run(
            [*COMMAND, command], stdout=output, stderr=subprocess.PIPE, timeout=60
        )
    assert done.stderr == b''
    # argparse itself keeps silent about help that nobody reads, where output is unbuffered.
    assert done.returncode == 128 + signal.SIGPIPE or command == '-h'


def test_a_full_disk_is_reported_in_one_line():
    if not Path('/dev/full').exists():
        pytest.skip('no /dev/full here')
    with open('/dev/full', 'w') as output:
        done = subprocess.run(
            [*COMMAND, 'list'],
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
    assert done.returncode == 2
    assert done.stderr.startswith('leg_fk: error: ') and done.stderr.count('\n') == 1


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_command_quietly(monkeypatch, number):
    monkeypatch.setattr(Catalog, 'load', lambda *_, **__: signal.raise_signal(number))
    done = run_main('list')
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, '', '')


def test_a_signal_that_is_ignored_as_by_nohup_stays_so(monkeypatch):
    shipped = Catalog.load()

    def load(*_, **__):
        signal.raise_signal(signal.SIGHUP)
        return shipped

    monkeypatch.setattr(Catalog, 'load', load)
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert run_main('list').returncode == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_terminal_without_utf_8_gets_escapes_instead_of_an_error(
    tmp_path, monkeypatch
):
    file = tmp_path / 'arm.yaml'
    links = '        links:'
    file.write_text(
        ARM.read_text().replace(links, f'        source: "M\u00fcller"\n{links}'),
        encoding='utf-8',
    )
    terminal = io.TextIOWrapper(io.BytesIO(), encoding='ascii')
    monkeypatch.setattr(sys, 'stdout', terminal)
    assert main(['list', '-k', str(file)]) == 0
    assert b'M\\xfcller' in terminal.buffer.getvalue()


@pytest.mark.parametrize(
    ('line', 'offered'),
    [
        ('leg_fk po', {'pose', 'poses'}),
        ('leg_fk pose --deg', {'--degrees'}),
        ('leg_fk pose left', {'left_leg'}),
        ('leg_fk pose head_imu=', {'v2', 'v3'}),
        ('leg_fk pose left_leg --version v2', {'v2_5'}),
        ('leg_fk urdf left_leg head_imu --version v2', {'v2', 'v2_5'}),
        ('leg_fk pose head_imu --foot-frame ', {'dh'}),
        (
            f'leg_fk pose -k {config_file("examples/ur5.yaml")} ur5 --version ',
            {'series_3'},
        ),
    ],
)
def test_the_shell_is_offered_what_fits(line, offered, tmp_path):
    pytest.importorskip('argcomplete')
    answer = tmp_path / 'answer'
    leg_fk(
        environment={
            '_ARGCOMPLETE': '1',
            'COMP_LINE': line,
            'COMP_POINT': str(len(line)),
            '_ARGCOMPLETE_IFS': '\n',
            '_ARGCOMPLETE_STDOUT_FILENAME': str(answer),
            '_ARGCOMPLETE_COMP_WORDBREAKS': '=',
        }
    )
    assert {word.strip() for word in answer.read_text().splitlines()} == offered


def test_a_closed_stderr_leaves_standard_output_alone(monkeypatch, capsys):
    monkeypatch.setattr(sys, 'stderr', None)
    assert main(['lsit']) == 2
    assert capsys.readouterr().out == ''
