"""The package installs: by pip, by pip as editable, by colcon; each from the files git knows."""

from collections.abc import Mapping
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
MARKER = Path('share/ament_index/resource_index/packages/icub_leg_fk')
SHARE = Path('share/icub_leg_fk')
TABLES = SHARE / 'config/icub_kinematics.yaml'
COMMANDS = ('foot_pose_publisher', 'leg_fk')
# What `colcon test` is tried on here; all of it would be this very run once more.
COLCON_TESTS = 'test/kinematics/test_rotation.py'
# Settings of this interpreter's own ROS, which another one must not inherit.
FOREIGN = (
    'PYTHONPATH',
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


def clean_environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in FOREIGN}


def run(
    *command: str | Path,
    cwd: Path,
    status: int = 0,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    result = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        text=True,
        check=False,
        env=env or clean_environment(),
        capture_output=True,
    )
    assert result.returncode == status, f'{command}\n{result.stdout}{result.stderr}'
    return result


def files(root: Path, *folders: str) -> set[Path]:
    return {
        path.relative_to(root)
        for folder in folders
        for path in (root / folder).rglob('*')
        if path.is_file() and path.suffix != '.pyc'
    }


@pytest.fixture(scope='module')
def known_files() -> set[Path]:
    """Return the files that git knows and that are there."""
    if shutil.which('git') is None or not (ROOT / '.git').exists():
        pytest.skip('not a git checkout')
    listing = run('git', 'ls-files', '-z', cwd=ROOT).stdout
    names = filter(None, listing.split('\0'))
    return {Path(name) for name in names if (ROOT / name).is_file()}


@pytest.fixture(scope='module')
def clone(known_files: set[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a workspace's folder with the files that git knows, as they are now."""
    return copy(known_files, tmp_path_factory.mktemp('workspace') / 'src/icub_leg_fk')


def copy(names: set[Path], folder: Path) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def install_in_new_venv(folder: Path, *what: str) -> Path:
    """Install by pip into a virtual environment that sees this run's libraries, but not ours."""
    pytest.importorskip('pip')
    run(sys.executable, '-m', 'venv', '--without-pip', folder, cwd=ROOT)
    [packages] = folder.glob('lib/*/site-packages')
    # Of a folder named in a .pth file no .pth files are read, and so not this run's own.
    (packages / 'of_this_run.pth').write_text(sysconfig.get_path('purelib'))
    run(
        sys.executable,
        '-m',
        'pip',
        '--python',
        folder / 'bin/python',
        'install',
        '--no-deps',
        *what,
        cwd=folder,
    )
    return folder


@pytest.fixture(scope='module')
def plain_venv(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a virtual environment after `pip install .`."""
    return install_in_new_venv(tmp_path_factory.mktemp('plain') / 'venv', str(clone))


@pytest.fixture(scope='module')
def editable_venv(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a virtual environment after `pip install --editable .`."""
    folder = tmp_path_factory.mktemp('editable') / 'venv'
    return install_in_new_venv(folder, '--editable', str(clone))


def assert_shares(prefix: Path, clone: Path) -> None:
    """Assert that a prefix has what ROS and the user look for in `share`."""
    assert (prefix / MARKER).is_file()
    assert (prefix / SHARE / 'package.xml').is_file()
    assert files(prefix / SHARE, 'config', 'launch') == files(clone, 'config', 'launch')


@builds_the_package
def test_pip_installs_the_commands_and_the_shared_files(
    plain_venv: Path, clone: Path
) -> None:
    for command in COMMANDS:
        assert os.access(plain_venv / 'bin' / command, os.X_OK)
    assert_shares(plain_venv, clone)
    [installed] = plain_venv.glob('lib/*/site-packages/*/__init__.py')
    assert installed.parent.name == 'icub_leg_fk'
    assert installed.with_name('py.typed').is_file()


@builds_the_package
def test_the_commands_that_pip_installed_run_and_find_the_shipped_config(
    plain_venv: Path, tmp_path: Path
) -> None:
    help_text = run(plain_venv / 'bin/foot_pose_publisher', '-h', cwd=tmp_path).stdout
    assert 'foot_pose_publisher' in help_text
    listing = run(plain_venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(plain_venv / TABLES) in listing
    assert 'left_leg' in listing


@builds_the_package
def test_an_editable_install_has_the_commands_and_finds_the_config(
    editable_venv: Path, clone: Path, tmp_path: Path
) -> None:
    listing = run(editable_venv / 'bin/leg_fk', 'list', cwd=tmp_path).stdout
    assert str(clone / 'config/icub_kinematics.yaml') in listing
    assert (editable_venv / 'bin/foot_pose_publisher').is_file()


@builds_the_package
def test_an_editable_install_is_found_and_typed_in_the_parent_of_the_clone(
    editable_venv: Path, clone: Path
) -> None:
    pytest.importorskip('mypy')
    python = editable_venv / 'bin/python'
    script = clone.parent / 'walk.py'
    script.write_text(USER_SCRIPT)
    run(python, '-c', 'from icub_leg_fk import load_chain', cwd=clone.parent)
    run(
        sys.executable,
        '-m',
        'mypy',
        '--strict',
        '--python-executable',
        python,
        '--cache-dir',
        ROOT / '.mypy_cache/of_a_user',
        script,
        cwd=clone.parent,
    )


@pytest.fixture(scope='module', params=[(), ('--symlink-install',)], ids=' '.join)
def colcon_prefix(
    request: pytest.FixtureRequest,
    known_files: set[Path],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """Return the install prefix of the package after `colcon build`, which has no complaint."""
    if shutil.which('colcon', path=colcon_environment()['PATH']) is None:
        pytest.skip('colcon is not installed')
    workspace = tmp_path_factory.mktemp('workspace')
    copy(known_files, workspace / 'src/icub_leg_fk')
    assert colcon(workspace, 'build', *request.param).stderr == ''
    return workspace / 'install/icub_leg_fk'


def colcon_environment() -> dict[str, str]:
    """Return the environment of this run, with this interpreter's colcon first."""
    path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
    unwanted = ('PYTEST_ADDOPTS', 'MAKEFLAGS', 'PYTHONDONTWRITEBYTECODE')
    return {**{k: v for k, v in os.environ.items() if k not in unwanted}, 'PATH': path}


def colcon(
    workspace: Path, verb: str, *options: str
) -> subprocess.CompletedProcess[str]:
    return run('colcon', verb, *options, cwd=workspace, env=colcon_environment())


@builds_the_package
def test_colcon_puts_the_commands_where_ros2_run_looks(
    colcon_prefix: Path, clone: Path
) -> None:
    for command in COMMANDS:
        assert os.access(colcon_prefix / 'lib/icub_leg_fk' / command, os.X_OK)
    assert_shares(colcon_prefix, clone)


@builds_the_package
def test_leg_fk_finds_the_shipped_config_where_colcon_put_it(
    colcon_prefix: Path,
) -> None:
    script = f'source {colcon_prefix.parent}/setup.bash && lib/icub_leg_fk/leg_fk list'
    listing = run(
        'bash', '-c', script, cwd=colcon_prefix, env=colcon_environment()
    ).stdout
    tables = colcon_prefix / TABLES
    shown = tables.readlink() if tables.is_symlink() else tables
    assert str(shown) in listing


@builds_the_package
@pytest.mark.parametrize(
    'colcon_prefix', [('--symlink-install',)], indirect=True, ids=' '.join
)
def test_colcon_test_runs_the_tests(colcon_prefix: Path) -> None:
    workspace = colcon_prefix.parents[1]
    colcon(
        workspace,
        'test',
        '--return-code-on-test-failure',
        '--pytest-args',
        COLCON_TESTS,
    )
    colcon(workspace, 'test-result', '--all')
    report = ElementTree.parse(workspace / 'build/icub_leg_fk/pytest.xml').find(
        'testsuite'
    )
    assert report is not None
    assert int(report.attrib['tests']) > int(report.attrib['skipped'])


@builds_the_package
def test_the_source_distribution_has_the_files_that_git_knows(
    known_files: set[Path], tmp_path: Path
) -> None:
    clone = copy(known_files, tmp_path / 'clone')
    made = run(
        sys.executable,
        'setup.py',
        '--quiet',
        'sdist',
        '--dist-dir',
        tmp_path,
        cwd=clone,
    )
    assert made.stderr == ''
    [archive] = tmp_path.glob('*.tar.gz')
    with tarfile.open(archive) as packed:
        names = {Path(*Path(name).parts[1:]) for name in packed.getnames()}
    assert known_files <= names


def test_package_xml_is_valid_and_says_what_setup_py_says() -> None:
    catkin_pkg = pytest.importorskip('catkin_pkg.package')
    package = catkin_pkg.parse_package(
        ROOT / 'package.xml'
    )  # checks the e-mail address too
    about = [
        line.strip()
        for line in run(
            sys.executable,
            'setup.py',
            '--quiet',
            '--name',
            '--version',
            '--license',
            '--maintainer',
            '--maintainer-email',
            cwd=ROOT,
            env=os.environ,
        ).stdout.splitlines()
    ]
    [maintainer] = package.maintainers
    assert about == [
        package.name,
        package.version,
        package.licenses[0],
        maintainer.name,
        maintainer.email,
    ]
    assert package.version == icub_leg_fk.__version__
    assert package.get_build_type() == 'ament_python'


def test_the_changelog_has_an_entry_for_this_version() -> None:
    catkin_changelog = pytest.importorskip('catkin_pkg.changelog')
    changelog = catkin_changelog.get_changelog_from_path(ROOT)
    assert changelog.get_content_of_version(icub_leg_fk.__version__)
