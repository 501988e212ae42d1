"""The package installs: by pip, by pip as editable, by colcon; each from the files git knows."""

from importlib.metadata import version
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from xml.etree import ElementTree

import icub_leg_fk
import pytest

ROOT = Path(__file__).resolve().parents[2]
SHARE = Path('share/icub_leg_fk')
TABLES = SHARE / 'config/icub_kinematics.yaml'
COMMANDS = ('foot_pose_publisher', 'leg_fk')
# What `colcon test` is tried on here; all of it would be this very run once more.
COLCON_TESTS = 'test/kinematics/test_rotation.py'
# Settings of this run, which what it builds must not inherit.
OWN_SETTINGS = (
    'PYTHONPATH',
    'PYTHONDONTWRITEBYTECODE',
    'LD_LIBRARY_PATH',
    'AMENT_PREFIX_PATH',
    'VIRTUAL_ENV',
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE',
    'PYTEST_ADDOPTS',
    'MAKEFLAGS',
)
# What a type checker that sees no types would not find, and one that does finds right.
USER_SCRIPT = """\
from icub_leg_fk import Chain, load_chain
import numpy as np
from numpy.typing import NDArray

leg: Chain = load_chain('left_leg', 'v2_5', frame='sole')
q = [0.0] * leg.n
x: float = leg.pose(q)[0]
T: NDArray[np.float64] = leg.forward(q)
poses: NDArray[np.float64] = leg.poses([q, q])
n: str = leg.n  # type: ignore[assignment]
leg.no_such_method  # type: ignore[attr-defined]
"""

builds_the_package = pytest.mark.skipif(
    'COLCON' in os.environ, reason='colcon is building and testing the package already'
)


def run(*command, cwd, **environment):
    """Run a command to its good end, with this interpreter's programs first."""
    inherited = {k: v for k, v in os.environ.items() if k not in OWN_SETTINGS}
    path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
    result = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        text=True,
        env={**inherited, 'PATH': path, **environment},
        capture_output=True,
    )
    assert result.returncode == 0, f'{command}\n{result.stdout}{result.stderr}'
    return result


@pytest.fixture(scope='module')
def known_files():
    """Return the files that git knows and that are there."""
    if shutil.which('git') is None or not (ROOT / '.git').exists():
        pytest.skip('not a git checkout')
    names = run('git', 'ls-files', '-z', cwd=ROOT).stdout.split('\0')
    return {Path(name) for name in names if (ROOT / name).is_file()}


@pytest.fixture(scope='module')
def clone(known_files, tmp_path_factory):
    return copy(known_files, tmp_path_factory.mktemp('workspace') / 'src/icub_leg_fk')


def copy(names, folder):
    """Return a folder with the files that git knows, as they are now."""
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def install_in_new_venv(folder, *what):
    """Install by pip into a virtual environment that sees this run's libraries, but not ours."""
    pytest.importorskip('pip')
    run(sys.executable, '-m', 'venv', '--without-pip', folder, cwd=ROOT)
    [packages] = folder.glob('lib/*/site-packages')
    # Of a folder named in a .pth file no .pth files are read, and so not this run's own.
    (packages / 'of_this_run.pth').write_text(sysconfig.get_path('purelib'))
    words = ['-m', 'pip', '--python', folder / 'bin/python', 'install', '--no-deps']
    if int(version('setuptools').partition('.')[0]) > 70:  # it can make wheels
        words.append('--no-build-isolation')
    run(sys.executable, *words, *what, cwd=folder)
    return folder


@pytest.fixture(scope='module')
def plain_venv(clone, tmp_path_factory):
    return install_in_new_venv(tmp_path_factory.mktemp('plain') / 'venv', clone)


@pytest.fixture(scope='module')
def editable_venv(clone, tmp_path_factory):
    folder = tmp_path_factory.mktemp('editable') / 'venv'
    return install_in_new_venv(folder, '--editable', clone)


def assert_installed(prefix, programs, clone):
    """Assert that a prefix has the commands, and what ROS and the user look for in `share`."""
    for command in COMMANDS:
        assert os.access(prefix / programs / command, os.X_OK)
    assert (prefix / 'share/ament_index/resource_index/packages/icub_leg_fk').is_file()
    assert (prefix / SHARE / 'package.xml').is_file()
    for folder in ('config', 'launch'):
        shared = (clone / folder).rglob('*')
        for file in shared:
            assert (prefix / SHARE / file.relative_to(clone)).exists()


@builds_the_package
def test_pip_installs_commands_that_run_and_find_the_shipped_config(
    plain_venv, clone, tmp_path
):
    assert_installed(plain_venv, 'bin', clone)
    [installed] = plain_venv.glob('lib/*/site-packages/icub_leg_fk')
    assert (installed / 'py.typed').is_file()
    help_text = run(plain_venv / 'bin/foot_pose_publisher', '-h', cwd=tmp_path).stdout
    assert 'foot_pose_publisher' in help_text
    listing = run(plain_venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(plain_venv / TABLES) in listing and 'left_leg' in listing


@builds_the_package
def test_a_wheel_says_what_it_needs(plain_venv):
    [information] = plain_venv.glob('lib/*/site-packages/icub_leg_fk-*.dist-info')
    lines = (information / 'METADATA').read_text().splitlines()
    needed = [line for line in lines if line.startswith('Requires-Dist: ')]
    needed = [line.split()[1] for line in needed if 'extra ==' not in line]
    assert needed == ['lxml', 'numpy>=1.26', 'PyYAML>=6.0']
    assert 'Description-Content-Type: text/markdown' in lines
    assert any('LICENSE' in file.name for file in information.rglob('*'))


@builds_the_package
def test_an_editable_install_has_the_commands_and_finds_the_config(
    editable_venv, clone, tmp_path
):
    listing = run(editable_venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(clone / 'config/icub_kinematics.yaml') in listing
    assert (editable_venv / 'bin/foot_pose_publisher').is_file()


@builds_the_package
def test_an_editable_install_is_found_and_typed_in_the_parent_of_the_clone(
    editable_venv, clone
):
    pytest.importorskip('mypy')
    python, cache = editable_venv / 'bin/python', ROOT / '.mypy_cache/of_a_user'
    (clone.parent / 'walk.py').write_text(USER_SCRIPT)
    run(python, '-c', 'from icub_leg_fk import load_chain', cwd=clone.parent)
    check = ['-m', 'mypy', '--strict', '--python-executable', python]
    run(sys.executable, *check, '--cache-dir', cache, 'walk.py', cwd=clone.parent)


@pytest.fixture(scope='module', params=[(), ('--symlink-install',)], ids=' '.join)
def colcon_prefix(request, known_files, tmp_path_factory):
    """Return the install prefix of the package after `colcon build`, which has no complaint."""
    if shutil.which('colcon', path=Path(sys.executable).parent) is None:
        pytest.skip('colcon is not installed')
    workspace = tmp_path_factory.mktemp('workspace')
    copy(known_files, workspace / 'src/icub_leg_fk')
    assert run('colcon', 'build', *request.param, cwd=workspace).stderr == ''
    return workspace / 'install/icub_leg_fk'


@builds_the_package
def test_colcon_puts_commands_where_ros2_run_looks_and_they_find_the_config(
    colcon_prefix,
):
    workspace = colcon_prefix.parents[1]
    assert_installed(
        colcon_prefix, 'lib/icub_leg_fk', workspace / 'src' / 'icub_leg_fk'
    )
    script = (
        'source install/setup.bash && install/icub_leg_fk/lib/icub_leg_fk/leg_fk list'
    )
    listing = run('bash', '-c', script, cwd=workspace).stdout
    tables = colcon_prefix / TABLES
    assert str(tables.readlink() if tables.is_symlink() else tables) in listing


@builds_the_package
@pytest.mark.parametrize(
    'colcon_prefix', [('--symlink-install',)], indirect=True, ids=' '.join
)
def test_colcon_test_runs_the_tests(colcon_prefix):
    workspace = colcon_prefix.parents[1]
    words = ['--return-code-on-test-failure', '--pytest-args', COLCON_TESTS]
    run('colcon', 'test', *words, cwd=workspace)
    run('colcon', 'test-result', '--all', cwd=workspace)
    report = ElementTree.parse(workspace / 'build/icub_leg_fk/pytest.xml')
    [suite] = report.getroot()
    assert int(suite.get('tests')) > int(suite.get('skipped'))


@builds_the_package
def test_the_source_distribution_has_the_files_that_git_knows(known_files, tmp_path):
    clone = copy(known_files, tmp_path / 'clone')
    words = ['setup.py', '--quiet', 'sdist', '--dist-dir', tmp_path]
    assert run(sys.executable, *words, cwd=clone).stderr == ''
    [archive] = tmp_path.glob('*.tar.gz')
    with tarfile.open(archive) as packed:
        names = {Path(*Path(name).parts[1:]) for name in packed.getnames()}
    assert known_files <= names


def test_package_xml_is_valid_and_says_what_setup_py_says():
    catkin_pkg = pytest.importorskip('catkin_pkg.package')
    package = catkin_pkg.parse_package(ROOT / 'package.xml')  # checks the e-mail, too
    asked = '--name --version --license --maintainer --maintainer-email'.split()
    about = run(sys.executable, 'setup.py', '--quiet', *asked, cwd=ROOT).stdout
    [maintainer] = package.maintainers
    assert [line.strip() for line in about.splitlines()] == [
        package.name,
        package.version,
        package.licenses[0],
        maintainer.name,
        maintainer.email,
    ]
    assert package.version == icub_leg_fk.__version__
    assert package.get_build_type() == 'ament_python'


def test_package_xml_needs_nothing_from_pip():
    """One such key ends `rosdep install` on Ubuntu 24.04."""
    assert '-pip' not in (ROOT / 'package.xml').read_text()


def test_the_changelog_has_an_entry_for_this_version():
    catkin_changelog = pytest.importorskip('catkin_pkg.changelog')
    changelog = catkin_changelog.get_changelog_from_path(ROOT)
    assert changelog.get_content_of_version(icub_leg_fk.__version__)
