"""The rooms of the package: who may import whom, and what is installed for it."""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
import subprocess
import sys

from icub_leg_fk.__main__ import COMMANDS
import pytest

PACKAGE = Path(__file__).resolve().parents[2] / 'icub_leg_fk'
MODULES = sorted(PACKAGE.rglob('*.py'))
# Which modules of the package those of a room may import, besides their own and the errors.
MAY_IMPORT: dict[str, set[str]] = {
    'kinematics': set(),
    'stream': {'kinematics'},
    'node': {'kinematics', 'stream'},
    'tools': {'kinematics', 'stream'},
    'commands': {'kinematics', 'stream', 'tools'},
}
OF_KINEMATICS = {*sys.stdlib_module_names, 'numpy', 'yaml', 'lxml', 'icub_leg_fk'}
OPTIONAL = [
    'argcomplete',
    'matplotlib',
    'mpl_toolkits',
    'rich',
    'rosbags',
    'sympy',
    'viser',
]
ROS = [
    'rclpy',
    'rcl_interfaces',
    'builtin_interfaces',
    'diagnostic_msgs',
    'geometry_msgs',
    'sensor_msgs',
    'std_msgs',
    'tf2_msgs',
    'visualization_msgs',
]

# Runs the program that follows as if the libraries named were not installed.
WITHOUT = """
import sys

class NotInstalled:
    def find_spec(name, path=None, target=None):
        if name.partition('.')[0] in {libraries!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)

sys.meta_path.insert(0, NotInstalled)
"""


def room_of(file: Path) -> str:
    """Return the name of a module's folder; of one at the top, its own."""
    return file.relative_to(PACKAGE).parts[0].removesuffix('.py')


def module_name(file: Path) -> str:
    parts = file.relative_to(PACKAGE.parent).with_suffix('').parts
    return '.'.join(parts).removesuffix('.__init__')


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding='utf-8'))


def imports(tree: ast.AST) -> Iterator[str]:
    """Give the full names of what a piece of code imports; the package has no relative imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'relative import in line {node.lineno}'
            yield from (f'{node.module}.{alias.name}' for alias in node.names)


def libraries_of(tree: ast.AST) -> set[str]:
    return {name.partition('.')[0] for name in imports(tree)}


def run_without(libraries: list[str], program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-c', WITHOUT.format(libraries=libraries) + program],
        cwd=PACKAGE.parent,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_the_package_has_its_rooms_and_no_other() -> None:
    folders = {room_of(file) for file in MODULES if file.parent != PACKAGE}
    assert folders == MAY_IMPORT.keys()
    at_the_top = {file.stem for file in PACKAGE.glob('*.py')}
    assert at_the_top == {'__init__', '__main__', 'errors'}


@pytest.mark.parametrize(
    'room',
    [
        'kinematics',
        'stream',
        'node',
        'tools',
        'commands',
    ],
)
def test_a_room_imports_only_rooms_below(room: str) -> None:
    allowed = {room, 'errors', '__version__'} | MAY_IMPORT[room]
    for file in (PACKAGE / room).rglob('*.py'):
        for name in imports(tree_of(file)):
            library, _, rest = name.partition('.')
            if library == PACKAGE.name:
                assert rest.partition('.')[0] in allowed, f'{file.name} imports {name}'


def test_kinematics_needs_numpy_yaml_and_lxml_alone() -> None:
    for file in (PACKAGE / 'kinematics').rglob('*.py'):
        others = libraries_of(tree_of(file)) - OF_KINEMATICS
        assert not others, f'{file.name} imports {others}'


def test_a_subcommand_is_the_one_module_of_its_name() -> None:
    commands = {file.stem for file in (PACKAGE / 'commands').glob('*.py')}
    assert commands == {*COMMANDS, '__init__'}
    elsewhere = {file.stem for file in MODULES if room_of(file) != 'commands'}
    assert not elsewhere & COMMANDS.keys()


def test_no_two_modules_have_one_name() -> None:
    names = Counter(file.stem for file in MODULES)
    del names['__init__']
    assert names.most_common(1)[0][1] == 1, names.most_common(3)


@pytest.mark.parametrize(
    ('node_too', 'libraries'),
    [
        pytest.param(False, OPTIONAL + ROS, id='all but the node, without ROS'),
        pytest.param(True, OPTIONAL, id='the node, with rclpy'),
    ],
)
def test_every_module_imports_without_optional_libraries(
    node_too: bool, libraries: list[str]
) -> None:
    if node_too:
        pytest.importorskip('rclpy')
    files = [file for file in MODULES if (room_of(file) == 'node') == node_too]
    names = [module_name(file) for file in files]
    imported = run_without(libraries, f'import {", ".join(names)}')
    assert (imported.returncode, imported.stderr) == (0, '')


def test_pose_needs_no_optional_library() -> None:
    words = ['pose', 'left_leg', '--degrees', '0', '10', '0', '-30', '-15', '5']
    program = f'from icub_leg_fk.__main__ import main; sys.exit(main({words}))'
    done = run_without(OPTIONAL + ROS, program)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'left_leg' in done.stdout


def test_the_node_needs_no_optional_library_to_start() -> None:
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


def functions_that_import(library: str) -> list[str]:
    """Return the functions outside of node/ with an import of a library."""
    found = []
    for file in MODULES:
        if room_of(file) == 'node':
            continue
        for node in ast.walk(tree_of(file)):
            if isinstance(node, ast.FunctionDef) and library in libraries_of(node):
                found.append(f'{file.name}: {node.name}')
    return found


@pytest.mark.parametrize(
    'library',
    [
        'argcomplete',
        'matplotlib',
        'mpl_toolkits',
        'rclpy',
        'rich',
        'rosbags',
        'sympy',
        'viser',
    ],
)
def test_an_optional_library_is_imported_in_one_function(library: str) -> None:
    found = functions_that_import(library)
    assert len(found) <= 1, found
