"""What README and documentation show is what happens."""

import ast
import os
from pathlib import Path
import re
import shlex
import subprocess
import sys

from icub_leg_fk import __main__ as leg_fk
from icub_leg_fk import load_chain
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
import yaml

ROOT = Path(__file__).parents[2]
PAGES = {
    path.name: path.read_text()
    for path in (
        ROOT / 'README.md',
        ROOT / 'CONTRIBUTING.md',
        ROOT / 'QUALITY_DECLARATION.md',
        ROOT / 'docs/index.rst',
        *sorted((ROOT / 'docs').glob('*.md')),
    )
}
README = PAGES['README.md']
LEG_FK = re.compile(
    r'(?:ros2 run icub_leg_fk |.*python -m icub_)?leg_fk (.*?)(?: > .*)?$'
)
NEEDS_ROS = re.compile(
    r'.*\bros2 |rosdep |colcon |\. install|python3 -m venv|~/|from launch '
)


def blocks(text, kind):
    return re.findall(rf'^```{kind}\n(.*?)^```', text, re.DOTALL | re.MULTILINE)


def commands(text):
    """Return the lines that have a prompt, without it."""
    return re.findall(r'^ *\$ (.+)$', text, re.MULTILINE)


def test_the_readme_can_be_read_in_ten_minutes():
    assert len(README.split()) <= 1000


@pytest.mark.parametrize('page', PAGES)
def test_no_line_of_code_is_cut_off(page):
    for block in blocks(PAGES[page], '[a-z]+'):
        assert max(map(len, block.splitlines())) <= 115


def test_the_front_page_shows_commands_of_the_readme():
    shown = commands(PAGES['index.rst'])
    assert shown
    assert set(shown) <= set(commands(README))


ANSWERS = [
    block
    for text in PAGES.values()
    for block in blocks(text, 'text')
    if block.startswith('$ leg_fk')
]


@pytest.mark.parametrize('block', ANSWERS)
def test_every_line_of_an_answer_is_printed_in_this_order(block, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    command, *shown = block.splitlines()
    assert leg_fk.main(shlex.split(command)[2:]) == 0
    printed = iter(line.rstrip() for line in capsys.readouterr().out.splitlines())
    for line in shown:
        if line.strip() not in ('...', ''):
            assert line in printed


def test_answers_are_shown():
    assert len(ANSWERS) == 3


@pytest.mark.parametrize('page', ['README.md', 'api.md'])
def test_the_library_examples_run(page):
    example, *others = blocks(PAGES[page], 'python')
    names = {}
    exec(example, names)
    assert names['T_root_sole'][:3, 3].tolist() == pytest.approx(
        list(names['leg'].pose(names['q'])[:3])
    )
    assert names['J'].shape == (6, 6)
    assert names['poses'].shape == (1000, 7)
    for other in others:
        exec(other, {})


def test_the_way_from_robometry_to_csv_works_as_shown(tmp_path, monkeypatch):
    h5py = pytest.importorskip('h5py')
    monkeypatch.chdir(tmp_path)
    names = load_chain('left_leg').joint_names
    with h5py.File('walk.mat', 'w') as file:
        recorded = file.create_group('robot_logger_device/joints_state/positions')
        recorded['data'] = np.zeros((10, 1, 6))
        recorded['timestamps'] = np.arange(10.0).reshape(10, 1)
        for name in names:
            file[f'#refs#/{name}'] = np.array([[ord(letter)] for letter in name])
        references = [file[f'#refs#/{name}'].ref for name in names]
        recorded['elements_names'] = np.array([references], dtype=h5py.ref_dtype)
    [example] = blocks(PAGES['command.md'], 'py')
    exec(example, {})
    assert leg_fk.main(['poses', 'walk.csv', '-o', 'feet.csv']) == 0


def test_the_kinematics_files_shown_can_be_read_and_one_is_the_shipped_example(
    tmp_path,
):
    shown = blocks(PAGES['kinematics_file.md'], 'yaml')
    assert shown[0].rstrip() == (ROOT / 'config/examples/ur5.yaml').read_text().rstrip()
    for block in shown:
        file = tmp_path / 'shown.yaml'
        file.write_text(block)
        assert not Catalog.load(file).warnings


@pytest.mark.parametrize('page', PAGES)
def test_every_command_has_arguments_that_are_known(page):
    """They are parsed, not run; `ros2 run` in front of them makes no difference."""
    for command in commands(PAGES[page]):
        found = LEG_FK.match(command)
        if found:
            leg_fk.parse(shlex.split(found[1]))


def texts(module):
    return texts_of(ast.parse(module.read_text()))


def texts_of(tree):
    """Return the texts in some code, docstrings apart; of an f-string its fixed parts."""
    nodes = list(ast.walk(tree))
    docstrings = [node.value for node in nodes if isinstance(node, ast.Expr)]
    constants = [node for node in nodes if isinstance(node, ast.Constant)]
    return [
        node.value
        for node in constants
        if isinstance(node.value, str) and node not in docstrings
    ]


def test_every_message_explained_is_one_of_the_code():
    code = '\n'.join(
        text
        for module in (ROOT / 'icub_leg_fk').rglob('*.py')
        for text in texts(module)
    )
    messages = re.findall(r'^\| (.*?) \| ', PAGES['no_poses.md'], re.MULTILINE)
    assert len(messages) > 50
    for message in re.findall('`(.*?)`', '\n'.join(messages)):
        for part in message.split('…'):
            assert part.strip() in code, message


# Faults of a program alone, and those of the form `found ..., allowed: ...`.
UNEXPLAINED = {
    *('chain', 'joint_vector', 'link', 'rotation'),
    *('input_bytes', 'kinematics_file', 'qos_overrides', 'yaml_fields'),
}
MODULES = sorted((ROOT / 'icub_leg_fk').rglob('*.py'))


@pytest.mark.parametrize(
    'module', ['stream/description.py', 'stream/notes.py', 'node/health.py']
)
def test_every_message_on_the_input_is_explained(module):
    for text in texts(ROOT / 'icub_leg_fk' / module):
        for part in re.split(r'\{.*?\}', text):
            if len(part) > 12 and ' ' in part.strip():
                assert part.strip() in PAGES['no_poses.md']


def faults(module):
    """Return the texts of each error and note that a module makes."""
    made = re.compile(
        r'FileError$|LegFKError$|ParameterError$|fail$|^Note$|\.notes\.append$'
    )
    found = []
    for node in ast.walk(ast.parse(module.read_text())):
        if isinstance(node, ast.Call) and made.search(ast.unparse(node.func)):
            found.append(texts_of(node))
    return found


@pytest.mark.parametrize('module', MODULES, ids=lambda module: module.stem)
def test_every_fault_is_explained(module):
    """Of each the first words of one of its texts are on the page, if it has a text."""
    if module.stem in UNEXPLAINED:
        return
    for fault in faults(module):
        starts = [text.strip(' :;,().').split()[:3] for text in fault]
        starts = [' '.join(words) for words in starts if len(words) > 1]
        assert not starts or any(start in PAGES['no_poses.md'] for start in starts), (
            fault
        )


def parameters():
    (section,) = yaml.safe_load(
        (ROOT / 'config/foot_pose_publisher.yaml').read_text()
    ).values()
    return section['ros__parameters']


@pytest.mark.parametrize('page', ['README.md', 'node.md'])
@pytest.mark.parametrize('name', parameters())
def test_the_tables_of_parameters_are_those_of_the_shipped_file(page, name):
    rows = re.findall(r'^\| (`[^|]*`) \| `([^`]*)` \|', PAGES[page], re.MULTILINE)
    [default] = [default for names, default in rows if f'`{name}`' in names.split(', ')]
    assert yaml.safe_load(default) == parameters()[name]


@pytest.mark.parametrize('page', PAGES)
def test_links_and_pictures_lead_somewhere(page):
    folder = ROOT / 'docs' if (ROOT / 'docs' / page).exists() else ROOT
    for target in re.findall(r'\]\(([^)]+)\)', PAGES[page]):
        if '://' in target:
            continue
        file, _, anchor = target.partition('#')
        assert not file or (folder / file).is_file(), target
        text = (folder / file).read_text() if file.endswith('.md') else PAGES[page]
        anchors = {
            re.sub(r'[^a-z0-9 _-]', '', line.lstrip('# ').lower()).replace(' ', '-')
            for line in text.splitlines()
            if line.startswith('#')
        }
        assert not anchor or anchor in anchors, target


# What runs until Ctrl-C, with what it then exits with.
UNTIL_CTRL_C = {'foot_pose_publisher': 0, 'leg_fk view': 130}


def until_ctrl_c(command):
    """Return a command that ends, with an error where its exit status is a wrong one."""
    for start, status in UNTIL_CTRL_C.items():
        if command.startswith(start):
            interrupted = f'timeout --preserve-status --signal=INT 5 {command}'
            return f'status=0; {interrupted} || status=$?; [ $status = {status} ]'
    return command


def script(page):
    """Return what somebody without ROS types who follows a page; the rest is told."""
    lines = ['set -ex', '. .venv/bin/activate']
    kinds = re.findall(
        r'^```(console|python)\n(.*?)^```', PAGES[page], re.DOTALL | re.MULTILINE
    )
    for kind, block in kinds:
        for typed in commands(block) if kind == 'console' else [block]:
            if NEEDS_ROS.match(typed):
                print('passed over:', typed)
            elif kind == 'python':
                lines.append(f"python - <<'END'\n{typed}END")
            else:
                lines.append(until_ctrl_c(typed))
    return '\n'.join(lines)


@pytest.fixture(scope='module')
def clone(tmp_path_factory):
    """Return a clone in which only `make demo` was typed."""
    folder = tmp_path_factory.mktemp('clone')
    subprocess.run(['git', 'clone', '--quiet', ROOT, folder], check=True)
    type_in(folder, 'make demo')
    return folder


def type_in(folder, lines):
    """Run lines of a shell that knows nothing of this run's environment."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name
        in ('PATH', 'HOME', 'LANG', 'ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE')
        or name.startswith('PIP_')
    }
    subprocess.run(
        ['bash', '-c', lines],
        cwd=folder,
        env=environment,
        stdout=sys.stdout,
        stderr=sys.stderr,
        check=True,
    )


@pytest.mark.skipif(
    'README_BLOCKS' not in os.environ,
    reason='sets up a fresh environment, for minutes: make readme',
)
@pytest.mark.parametrize(
    'page', [page for page, text in PAGES.items() if blocks(text, 'console')]
)
def test_every_block_works_in_order_in_a_fresh_clone(page, clone):
    subprocess.run(['git', 'clean', '-xfdq', '--exclude=.venv'], cwd=clone, check=True)
    type_in(clone, script(page))
