"""The `leg_fk` command as a whole: help, start-up, pipes, signals, mistakes, completion."""

from importlib.util import find_spec
import io
import os
from pathlib import Path
import re
import runpy
import shlex
import shutil
import signal
import subprocess
import sys

import icub_leg_fk
from icub_leg_fk.__main__ import COMMANDS, main
from icub_leg_fk.kinematics import Catalog, config_file
from icub_leg_fk.tools import signals
import pytest
from support.leg_fk_process import leg_fk, run_main
from support.recorded_walk import DATA
from support.robots import joint, robot

ARM = config_file('examples/cylindrical_arm.yaml')
TABLE = """\
units: {length: mm, angle: deg}
chains:
  arm:
    tip: hand
    root_frame: base
    joints: [turn]
    tip_frames: {dh: {frame: hand}}
    versions: {v1: {links: [LINKS]}}
"""
# Files that are not what is asked for.
FILES = {
    'empty': b' \n',
    'bytes': bytes(range(256)),
    'text.txt': b'left_leg',
    'arm.yaml': ARM.read_bytes(),
    'theta.yaml': TABLE.replace('LINKS', '{a: 0, d: 0, alpha: 0, theta: 90}').encode(),
    'no_rows.yaml': TABLE.replace('LINKS', '').encode(),
    'page.html': b'<!DOCTYPE html><html/>',
    'links.urdf': b'<robot name="r"><link name="base"/><link name="base2"/></robot>',
    'link.urdf': b'<robot name="r"><link name="base"/></robot>',
    'nothing.urdf': b'<robot name="r"/>',
    'utf16.urdf': '<robot name="r"><link name="base"/></robot>'.encode('utf-16'),
    'arm.urdf': robot([joint(0), joint(1)]).encode(),
    'number.urdf': robot([joint(0), joint(1, xyz='1_0 0 0')]).encode(),
    'arm.xacro': b'<robot xmlns:xacro="x"><xacro:include filename="f"/></robot>',
    'old.xacro': b'<robot><macro name="leg"><link name="a"/></macro><leg/></robot>',
    'knee.tsv': b'time\tl_knee\n0\t0\n1\t0.1\n',
    'knee.dat': b'time,l_knee\n0,0\n1,0.1\n',
}

# What is typed, and words of the answer: one line on stderr, whose exit status is 2.
MISTAKES = r"""
$ help
leg_fk -h explains them
$ lsit
unknown command 'lsit'; did you mean 'list'? known: list, pose
$ --verison
unknown option --verison; did you mean --version?
$ --verbose
unknown option --verbose (see leg_fk -h)
$ -1
invalid choice: '-1'
$ list --js
unknown option --js; did you mean --json?
$ list left_leg
unrecognized arguments: left_leg
$ pose left_leg --radian 0
unknown option --radian; did you mean --radians?
$ pose left_leg -degrees 0
unknown option -degrees; did you mean --degrees?
$ pose left_leg --deg=0
unknown option --deg; did you mean --degrees?
$ pose left_leg --frame sole
did you mean --foot-frame?
$ plot x.csv --ouput y
did you mean --output?
$ demo --colour
unknown option --colour (see leg_fk demo -h)
$ pose left_arm --degrees 0 0 0 0 0 0
'left_arm'; known: left_leg, right_leg, head_imu
$ pose Left_Leg --degrees 0 0 0 0 0 0
did you mean 'left_leg'?
$ pose left_foot --degrees 0 0 0 0 0 0
left_foot is the tip of left_leg
$ pose r_sole --degrees 0 0 0 0 0 0
r_sole is the sole frame of right_leg
$ pose left_leg --version V2_5 --degrees 0 0 0 0 0 0
'V2_5' of chain left_leg; did you mean 'v2_5'? known: v1, v2_5, v3
$ pose left_leg=v9 --degrees 0 0 0 0 0 0
known: v1, v2_5, v3
$ pose left_leg --version "" --degrees 0 0 0 0 0 0
is empty; leave it out for its default
$ pose left_leg --foot-frame toe --degrees 0 0 0 0 0 0
known: dh, sole
$ pose head_imu --foot-frame sole --degrees 0 0 0 0 0 0
known: dh
$ pose left_leg -k "" --degrees 0 0 0 0 0 0
is empty; leave it out for its default
$ pose left_leg -k none.yaml --degrees 0 0 0 0 0 0
none.yaml
$ list -k .
cannot read .
$ pose left_leg
one of the arguments --degrees --radians is required
$ pose left_leg --degrees
expected at least one argument
$ pose left_leg --degrees 0 --radians 0
not allowed with
$ pose left_leg --degrees 0 0 0 0 0
has 5 entries; allowed: 6, in the order l_hip_pitch l_hip
$ pose left_leg --degrees 0 0 0 0 0 0 0
has 7 entries; allowed: 6
$ pose left_leg --degrees 0 zero
found 'zero', allowed: finite numbers
$ pose left_leg --degrees 0 nan
found 'nan', allowed: finite numbers
$ pose left_leg --degrees 0 -inf
found '-inf', allowed: finite numbers
$ pose left_leg --degrees 0 1e999
found '1e999', allowed: finite numbers
$ pose left_leg --degrees 0 1e308
allowed: finite numbers up to 1e+09
$ pose left_leg --degrees 1_0
found '1_0'
$ pose left_leg --degrees 10,-20,30
numbers are separated by spaces
$ pose left_leg --degrees -10,-20,30
numbers are separated by spaces
$ pose --degrees 0 0 0 0 0 0 left_leg
found 'left_leg', allowed: finite numbers
$ urdf elbow
unknown chain 'elbow'
$ urdf left_foot
left_foot is the tip of left_leg
$ urdf left_leg left_leg
named twice
$ urdf left_leg left_leg=v1
named twice
$ urdf left_leg=v3 right_leg
do not go together
$ urdf --version v9
unknown version 'v9'; known: v1, v2_5, v3, v2
$ urdf head_imu --version v9
known: v2
$ urdf -k no_such_file.yaml
no_such_file.yaml
$ urdf --name ""
--name is ''; allowed: printable text
$ urdf left_leg -o -1
begins with a minus sign
$ urdf left_leg -o -1.urdf
begins with a minus sign
$ urdf left_leg -o -x.urdf
unknown option -x.urdf
$ urdf left_leg -o /dev/null
/dev/null
$ urdf left_leg -o /no/such/folder/x.urdf
there is no directory
$ urdf left_leg -o /proc/x.urdf
/proc/x.urdf: cannot be written: no such file
$ urdf left_leg -o ""
'': is not the name of a file
$ urdf left_leg -o /
'/': is not the name of a file
$ demo -o /proc/x.png
/proc/x.png: cannot be written: no such file
$ demo -o ""
'': is not the name of a file
$ demo --save /proc/x
/proc/x: cannot be written: no such file
$ explain
the following arguments are required: CHAIN
$ explain left_leg --json --latex
not allowed with
$ list -k empty
found nothing, allowed: units and chains
$ list -k bytes
not printable UTF-8 text
$ list -k text.txt
found 'left_leg', allowed: a mapping with units
$ list -k page.html
is not a URDF: its root is <html>
$ list -k link.urdf
has no chain: no joint moves a link at its ends
$ list -k links.urdf
has 2 links at the top (base, base2)
$ list -k nothing.urdf
has no links
$ list -k utf16.urdf
is UTF-16 text; allowed: UTF-8
$ list -k arm.xacro
xacro arm.xacro > robot.urdf
$ urdf -k link.urdf
has no chain
$ list -k arm.urdf --root l9
unknown link 'l9' of arm.urdf
$ list -k arm.urdf --root ""
--root is empty; leave it out for its default
$ pose l2 -k arm.urdf --root l1 --degrees 0 0
2 entries; allowed: 1, in the order j1
$ explain l1 -k arm.urdf --root l1
no joint moves between 'l1' and 'l1'
$ pose left_leg -k arm.urdf --degrees 0
unknown chain 'left_leg'; known: l2
$ table empty
is empty
$ table ""
cannot read '': no such file
$ table text.txt
it has no element
$ table arm.yaml
is a kinematics file; allowed here: a URDF
$ table link.urdf
has no chain
$ table nothing.urdf
has no links
$ table arm.urdf
has none of the iCub's chains; give --tips, such as l2
$ table arm.urdf --tips l9
unknown chain 'l9'
$ compare arm.yaml
is a kinematics file; allowed here: a URDF
$ compare arm.urdf
-k tables with the names of this robot
$ compare arm.urdf --chains left_leg=v9
unknown version 'v9' of chain left_leg
$ compare arm.urdf --chains l_sole
l_sole is the sole frame of left_leg
$ list -k theta.yaml
found key theta, allowed: offset instead
$ list -k no_rows.yaml
found an empty list, allowed: a list of rows, at least one
$ list -k loop
cannot read loop: too many levels of symbolic links
$ poses loop
loop: is a loop of links
$ list -k old.xacro
xacro old.xacro > robot.urdf
$ pose l2 -k number.urdf --degrees 0 0
xyz is '1_0 0 0'; allowed: 3 finite numbers
$ table number.urdf --tips l2
xyz is '1_0 0 0'; allowed: 3 finite numbers
$ poses knee.tsv
is missing in the header (time, l_knee)
$ plot knee.dat
a CSV file (.csv, .tsv or .txt) or a directory of yarpdatadumper
$ poses knee.tsv --chains left_leg left_leg
named twice
"""
ANSWERS = re.findall(r'^\$ (.*)\n(.*)', MISTAKES, re.MULTILINE)
ANSWERS += [
    ("'po\nse'", "unknown command 'po\\nse'"),
    ("urdf --name 'a\x01b'", "--name is 'a\\x01b'; allowed: printable text"),
]
if find_spec('rosbags'):
    ANSWERS += [
        ('poses walk --joint-topic /other', '--joint-topic can be /joint_states'),
        ('bag newer out', 'a newer rosbags may read it; its files alone can be given'),
    ]

# What is right as typed, and words of the one line on stderr that comes with the answer.
WARNINGS = [
    (
        'pose left_leg --radians 10 20 0 0 0 0',
        'look like degrees, for which there is --degrees: l_hip_pitch 10, l_hip_roll 20',
    ),
]


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with the files, a loop of links, and bags."""
    made = tmp_path_factory.mktemp('files')
    for name, content in FILES.items():
        (made / name).write_bytes(content)
    (made / 'loop').symlink_to('loop')
    edits = {'walk': '', 'newer': 'version: 99', 'other_name': 'w\u00e4lk.mcap'}
    for name, edit in edits.items():
        bag = shutil.copytree(DATA / 'walk_mcap', made / name)
        text = (bag / 'metadata.yaml').read_text()
        old = 'version: 9' if 'version' in edit else 'walk_mcap.mcap'
        text = text.replace(old, edit or old)
        (bag / 'metadata.yaml').write_text(text, encoding='utf-8')
    (made / 'other_name' / 'walk_mcap.mcap').rename(
        made / 'other_name' / edits['other_name']
    )
    return made


def assert_one_line(done, answer):
    assert done.stderr.startswith('leg_fk: ') and done.stderr.count('\n') == 1
    assert answer in done.stderr


@pytest.mark.parametrize(('typed', 'answer'), ANSWERS)
def test_an_answer_is_one_line_that_helps(typed, answer, folder, monkeypatch):
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob('*'))
    done = run_main(*shlex.split(typed))
    assert (done.returncode, done.stdout) == (2, '')
    assert_one_line(done, answer)
    assert sorted(folder.rglob('*')) == before


@pytest.mark.parametrize(('typed', 'warning'), WARNINGS)
def test_a_doubt_is_one_line_beside_the_answer(typed, warning):
    done = run_main(*shlex.split(typed))
    assert done.returncode == 0 and done.stdout
    assert_one_line(done, warning)


def test_answers_are_as_good_in_the_c_locale(folder):
    program = (
        'import shlex, sys; from icub_leg_fk.__main__ import main; '
        'print({main(shlex.split(typed)) for typed in sys.argv[1:]})'
    )
    rows = [*ANSWERS, ('pose left_l\u00e9g --degrees 0', 'unknown chain')]
    if find_spec('rosbags'):
        rows.append(('poses other_name', 'is not UTF-8, set PYTHONUTF8=1'))
    done = subprocess.run(
        [sys.executable, '-X', 'utf8=0', '-c', program, *(typed for typed, _ in rows)],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=60,
        env={**os.environ, 'LC_ALL': 'C', 'PYTHONCOERCECLOCALE': '0'},
    )
    assert done.stdout == '{2}\n'
    for (_, answer), line in zip(rows, done.stderr.splitlines(), strict=True):
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
    usage, *_ = run_main('pose', '-h').stdout.splitlines()
    words = '(--degrees Q ... | --radians Q ...) [options]'
    assert usage == f'usage: leg_fk pose CHAIN {words}'
    done = run_main('pose', 'left_leg', '--degrees', *'000000', '--json')
    assert done.returncode == 0
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


@pytest.mark.parametrize(('word', 'command'), [('list', {'list'}), ('-h', set())])
def test_a_command_imports_its_own_module_and_no_optional_library(word, command):
    program = (
        'import atexit, sys; from icub_leg_fk.__main__ import main; '
        "atexit.register(lambda: print(*sys.modules, sep='\\n', file=sys.stderr)); "
        f'sys.exit(main([{word!r}]))'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0
    modules = set(done.stderr.split())
    optional = {'sympy', 'matplotlib', 'rosbags', 'rclpy', 'rich', 'viser'}
    assert optional.isdisjoint(modules)
    commands = {module.removeprefix('icub_leg_fk.commands.') for module in modules}
    assert commands & {*COMMANDS} == command


@pytest.mark.parametrize('command', ['list', '-h'])
def test_a_reader_that_leaves_ends_the_command_quietly(command):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, 'w') as output:
        done = leg_fk(command, stdout=output)
    assert done.stderr == ''
    # argparse itself keeps silent about help that nobody reads, where output is unbuffered.
    assert done.returncode == 128 + signal.SIGPIPE or command == '-h'


def test_a_full_disk_is_reported_in_one_line():
    if not Path('/dev/full').exists():
        pytest.skip('no /dev/full here')
    with open('/dev/full', 'w') as output:
        done = leg_fk('list', stdout=output)
    assert done.returncode == 2
    assert_one_line(done, 'error: ')


def test_without_sighup_as_on_windows_a_signal_ends_it_as_well(monkeypatch):
    monkeypatch.delattr(signal, 'SIGHUP')
    stop_on_signals = runpy.run_path(signals.__file__)['stop_on_signals']
    with pytest.raises(SystemExit, match='143'), stop_on_signals():
        signal.raise_signal(signal.SIGTERM)


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
