"""The package installs: by pip, by pip as editable, by colcon; each from the files git knows."""

from collections.abc import Mapping
import os
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree

import icub_leg_fk
import pytest

ROOT = Path(__file__).resolve().parents[2]
MARKER = Path('share/ament_index/resource_index/packages/icub_leg_fk')
SHARE = Path('share/icub_leg_fk')
COMMANDS = ('foot_pose_publisher', 'leg_fk')
# What `colcon test` is tried on here; all of it would be this very run once more.
COLCON_TESTS = 'test_gait or test_launch'
# Settings of this interpreter's own ROS, which another one must not inherit.
FOREIGN = ('PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH', 'VIRTUAL_ENV',
           '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTEST_ADDOPTS', 'MAKEFLAGS')

builds_the_package = pytest.mark.skipif(
    'COLCON' in os.environ, reason='colcon is building and testing the package already')


def clean_environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in FOREIGN}


def run(*command: str | Path, cwd: Path, status: int = 0, env: Mapping[str, str] | None = None
        ) -> subprocess.CompletedProcess[str]:
    result = subprocess.run([str(word) for word in command], cwd=cwd, text=True, check=False,
                            env=env or clean_environment(), capture_output=True)
    assert result.returncode == status, f'{command}\n{result.stdout}{result.stderr}'
    return result


@pytest.fixture(scope='module')
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that git knows, as they are now, and no others."""
    if shutil.which('git') is None or not (ROOT / '.git').exists():
        pytest.skip('not a git checkout')
    folder = tmp_path_factory.mktemp('workspace') / 'src'
    listing = run('git', 'ls-files', '-z', cwd=ROOT).stdout
    for name in filter(None, listing.split('\0')):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder


def install_in_new_venv(folder: Path, *what: str) -> Path:
    run(sys.executable, '-m', 'venv', folder, cwd=ROOT)
    run(folder / 'bin/python', '-m', 'pip', 'install', *what, cwd=folder)
    return folder


@pytest.fixture(scope='module')
def plain_venv(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a new virtual environment after `pip install .[ros]`."""
    return install_in_new_venv(tmp_path_factory.mktemp('plain') / 'venv', f'{clone}[ros]')


@pytest.fixture(scope='module')
def colcon_prefix(clone: Path) -> Path:
    """Return the install prefix of the package after `colcon build`."""
    if shutil.which('colcon', path=colcon_environment()['PATH']) is None:
        pytest.skip('colcon is not installed')
    colcon(clone.parent, 'build')
    return clone.parent / 'install/icub_leg_fk'


def colcon_environment() -> dict[str, str]:
    """Return the environment of this run, with this interpreter's colcon first."""
    path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
    unwanted = ('PYTEST_ADDOPTS', 'MAKEFLAGS')
    return {**{k: v for k, v in os.environ.items() if k not in unwanted}, 'PATH': path}


def colcon(workspace: Path, verb: str, *options: str) -> None:
    paths = ('--base-paths', 'src') if verb != 'test-result' else ()
    run('colcon', verb, *paths, *options, cwd=workspace, env=colcon_environment())


def run_sourced(prefix: Path, command: str) -> str:
    script = f'source "{prefix.parent}/setup.bash" && {command}'
    return run('bash', '-c', script, cwd=prefix, env=colcon_environment()).stdout


def files(root: Path, *folders: str) -> set[Path]:
    return {path.relative_to(root) for folder in folders for path in (root / folder).rglob('*')
            if path.is_file() and path.suffix != '.pyc'}


def assert_shares(prefix: Path, clone: Path) -> None:
    """Assert that a prefix has what ROS and the user look for in `share`."""
    assert (prefix / MARKER).is_file()
    assert (prefix / SHARE / 'package.xml').is_file()
    assert files(prefix / SHARE, 'config', 'launch') == files(clone, 'config', 'launch')


@builds_the_package
def test_pip_installs_the_commands_and_the_shared_files(
        plain_venv: Path, clone: Path) -> None:
    for command in COMMANDS:
        assert os.access(plain_venv / 'bin' / command, os.X_OK)
    assert_shares(plain_venv, clone)
    assert list(plain_venv.glob('lib/*/site-packages/icub_leg_fk/py.typed'))


@builds_the_package
def test_leg_fk_finds_the_shipped_config_where_pip_put_it(
        plain_venv: Path, tmp_path: Path) -> None:
    listing = run(plain_venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(plain_venv / SHARE / 'config/icub_kinematics.yaml') in listing
    assert 'left_leg' in listing


@builds_the_package
def test_the_ros_extra_is_enough_to_start_the_node(plain_venv: Path, tmp_path: Path) -> None:
    node = run(plain_venv / 'bin/foot_pose_publisher', '--ros-args', '-p', 'version:=v9',
               cwd=tmp_path, status=1)
    assert len(node.stderr.splitlines()) == 1
    assert 'v9' in node.stderr
    assert 'v2_5' in node.stderr


@builds_the_package
def test_an_editable_install_has_the_commands_and_finds_the_config(
        clone: Path, tmp_path: Path) -> None:
    venv = install_in_new_venv(tmp_path / 'venv', '--editable', str(clone))
    listing = run(venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(clone / 'config/icub_kinematics.yaml') in listing
    assert (venv / 'bin/foot_pose_publisher').is_file()


@builds_the_package
def test_colcon_puts_the_commands_where_ros2_run_looks(
        colcon_prefix: Path, clone: Path) -> None:
    for command in COMMANDS:
        assert os.access(colcon_prefix / 'lib/icub_leg_fk' / command, os.X_OK)
    assert_shares(colcon_prefix, clone)


@builds_the_package
def test_leg_fk_finds_the_shipped_config_where_colcon_put_it(colcon_prefix: Path) -> None:
    listing = run_sourced(colcon_prefix, 'lib/icub_leg_fk/leg_fk list')
    assert str(colcon_prefix / SHARE / 'config/icub_kinematics.yaml') in listing


@builds_the_package
def test_colcon_test_runs_the_tests(colcon_prefix: Path) -> None:
    workspace = colcon_prefix.parents[1]
    colcon(workspace, 'test', '--return-code-on-test-failure',
           '--pytest-args', ' -k', COLCON_TESTS)
    colcon(workspace, 'test-result', '--all')
    report = ElementTree.parse(workspace / 'build/icub_leg_fk/pytest.xml').find('testsuite')
    assert report is not None
    assert int(report.attrib['tests']) > int(report.attrib['skipped'])


def test_package_xml_is_valid_and_says_what_setup_py_says() -> None:
    catkin_pkg = pytest.importorskip('catkin_pkg.package')
    package = catkin_pkg.parse_package(ROOT / 'package.xml')  # checks the e-mail address too
    about = [
        line.strip() for line in run(
            sys.executable, 'setup.py', '--quiet', '--name', '--version', '--license',
            '--maintainer', '--maintainer-email', cwd=ROOT, env=os.environ).stdout.splitlines()]
    [maintainer] = package.maintainers
    assert about == [package.name, package.version, package.licenses[0],
                     maintainer.name, maintainer.email]
    assert package.version == icub_leg_fk.__version__
    assert package.get_build_type() == 'ament_python'


def test_the_changelog_has_an_entry_for_this_version() -> None:
    changelog = (ROOT / 'CHANGELOG.rst').read_text()
    assert f'\n{icub_leg_fk.__version__} (' in changelog
