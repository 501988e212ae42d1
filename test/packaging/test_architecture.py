"""The rooms of the package: who may import whom, and what is installed for it."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
import subprocess
import sys

from icub_leg_fk.__main__ import COMMANDS
import pytest

PACKAGE = Path(__file__).resolve().parents[2] / 'icub_leg_fk'
MODULES = sorted(PACKAGE.rglob('*.py'))
# Which modules of the package those of a room may import, besides their own and the errors.
MAY_IMPORT = {
    'kinematics': set(),
    'stream': {'kinematics'},
    'node': {'kinematics', 'stream'},
    'tools': {'kinematics', 'stream'},
    'commands': {'kinematics', 'stream', 'tools'},
}
OF_KINEMATICS = {*sys.stdlib_module_names, 'numpy', 'yaml', 'lxml', 'icub_leg_fk'}
OPTIONAL = 'argcomplete matplotlib mpl_toolkits rich rosbags sympy viser'.split()
ROS = (
    'rclpy rcl_interfaces builtin_interfaces diagnostic_msgs geometry_msgs sensor_msgs '
    'std_msgs tf2_msgs visualization_msgs'
).split()

# Runs the program that follows as if the libraries named were not installed.
WITHOUT = """
import sys

class NotInstalled:
    def find_spec(name, path=None, target=None):
        if name.partition('.')[0] in {libraries!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)

sys.meta_path.insert(0, NotInstalled)
"""


def room_of(file):
    """Return the name of a module's folder; of one at the top, its own."""
    return file.relative_to(PACKAGE).parts[0].removesuffix('.py')


def module_name(file):
    parts = file.relative_to(PACKAGE.parent).with_suffix('').parts
    return '.'.join(parts).removesuffix('.__init__')


@cache
def tree_of(file):
    return ast.parse(file.read_text(encoding='utf-8'))


def imports(tree):
    """Give the full names of what a piece of code imports; the package has no relative imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'relative import in line {node.lineno}'
            yield from (f'{node.module}.{alias.name}' for alias in node.names)


@cache
def libraries_of(tree):
    return {name.partition('.')[0] for name in imports(tree)}


def run_without(libraries, program):
    return subprocess.run(
        [sys.executable, '-c', WITHOUT.format(libraries=libraries) + program],
        cwd=PACKAGE.parent,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_the_package_has_its_rooms_and_no_other():
    folders = {room_of(file) for file in MODULES if file.parent != PACKAGE}
    assert folders == MAY_IMPORT.keys()
    at_the_top = {file.stem for file in PACKAGE.glob('*.py')}
    assert at_the_top == {'__init__', '__main__', 'errors'}


@pytest.mark.parametrize('room', MAY_IMPORT)
def test_a_room_imports_only_rooms_below(room):
    allowed = {room, 'errors', '__version__'} | MAY_IMPORT[room]
    for file in (PACKAGE / room).rglob('*.py'):
        for name in imports(tree_of(file)):
            library, _, rest = name.partition('.')
            if library == PACKAGE.name:
                assert rest.partition('.')[0] in allowed, f'{file.name} imports {name}'


def test_kinematics_needs_numpy_yaml_and_lxml_alone():
    for file in (PACKAGE / 'kinematics').rglob('*.py'):
        others = libraries_of(tree_of(file)) - OF_KINEMATICS
        assert not others, f'{file.name} imports {others}'


def test_a_subcommand_is_the_one_module_of_its_name():
    commands = {file.stem for file in (PACKAGE / 'commands').glob('*.py')}
    assert commands == {*COMMANDS, '__init__'}
    elsewhere = {file.stem for file in MODULES if room_of(file) != 'commands'}
    assert not elsewhere & COMMANDS.keys()


def test_no_two_modules_have_one_name():
    names = Counter(file.stem for file in MODULES)
    del names['__init__']
    assert names.most_common(1)[0][1] == 1, names.most_common(3)


@pytest.mark.parametrize('is_node', [False, True], ids=['all others', 'the node'])
def test_every_module_imports_without_optional_libraries(is_node):
    libraries = OPTIONAL
    if is_node:
        pytest.importorskip('rclpy')
    else:
        libraries = OPTIONAL + ROS
    files = [file for file in MODULES if (room_of(file) == 'node') == is_node]
    imported = run_without(libraries, f'import {", ".join(map(module_name, files))}')
    assert (imported.returncode, imported.stderr) == (0, '')


def test_pose_needs_no_optional_library():
    words = ['pose', 'left_leg', '--degrees', '0', '10', '0', '-30', '-15', '5']
    program = f'from icub_leg_fk.__main__ import main; sys.exit(main({words}))'
    done = run_without(OPTIONAL + ROS, program)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'left_leg' in done.stdout


def test_the_node_needs_no_optional_library_to_start():
    pytest.importorskip('rclpy')
    words = ['foot_pose_publisher', '--ros-args', '-p', 'version:=v9']
    program = (
        f'sys.argv = {words}; from icub_leg_fk.node.main import main; sys.exit(main())'
    )
    done = run_without(OPTIONAL, program)
    assert done.returncode == 1
    assert (
        'v2_5' in done.stderr
    )  # it came as far as to list the versions that there are


@pytest.mark.parametrize('library', [*OPTIONAL, 'rclpy'])
def test_an_optional_library_is_imported_in_one_function(library):
    found = []
    for file in MODULES:
        if room_of(file) == 'node':
            continue
        for node in ast.walk(tree_of(file)):
            if isinstance(node, ast.FunctionDef) and library in libraries_of(node):
                found.append(f'{file.name}: {node.name}')
    assert len(found) <= 1, found
