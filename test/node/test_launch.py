"""The launch file starts the node with what its arguments say."""

from pathlib import Path
import signal
import subprocess
import sys
import threading

import pytest

LAUNCH_FILE = Path(__file__).resolve().parents[2] / 'launch/foot_poses_launch.py'
ARGUMENTS = {
    'version', 'chains', 'kinematics_file', 'foot_frame', 'frame_prefix', 'publish_tf',
    'publish_twist', 'publish_markers', 'use_sim_time', 'params_file', 'namespace', 'log_level',
    'rviz'}
TIMEOUT = 90  # s

# What `ros2 launch FILE NAME:=VALUE ...` does, without ros2cli.
ROS2_LAUNCH = f"""
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
arguments = [argument.split(':=') for argument in sys.argv[1:]]
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource({str(LAUNCH_FILE)!r}), launch_arguments=arguments)]))
sys.exit(service.run())
"""


@pytest.fixture
def needs_launch() -> None:
    """Skip where the launch system is absent, or the package not where it looks."""
    pytest.importorskip('launch_ros', reason='launch_ros is not installed; ROS 2 brings it')
    packages = pytest.importorskip('ament_index_python.packages')
    try:
        packages.get_package_prefix('icub_leg_fk')
    except packages.PackageNotFoundError:
        pytest.skip('icub_leg_fk is not in the ament index: build it with colcon and source it')


def start(*arguments: str) -> 'subprocess.Popen[str]':
    return subprocess.Popen([sys.executable, '-c', ROS2_LAUNCH, *arguments], text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def output_of(*arguments: str) -> str:
    with start(*arguments) as launch:
        try:
            return launch.communicate(timeout=TIMEOUT)[0]
        finally:
            launch.kill()


def test_the_launch_file_compiles() -> None:
    code = compile(LAUNCH_FILE.read_text(), LAUNCH_FILE, 'exec')
    assert 'generate_launch_description' in code.co_names


def test_the_arguments_are_the_documented_ones(needs_launch: None) -> None:
    from launch.actions import DeclareLaunchArgument
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    description = get_launch_description_from_python_launch_file(str(LAUNCH_FILE))
    arguments = [entity for entity in description.entities
                 if isinstance(entity, DeclareLaunchArgument)]
    assert {argument.name for argument in arguments} == ARGUMENTS
    assert all(argument.description for argument in arguments)


# The node refuses a version that it does not know, so its complaint tells what reached it.
@pytest.mark.parametrize('section', ['/**', '/foot_pose_publisher', '/**/foot_pose_publisher'])
def test_an_argument_wins_over_the_parameter_file(
        needs_launch: None, tmp_path: Path, section: str) -> None:
    params = tmp_path / 'params.yaml'
    params.write_text(f'{section}: {{ros__parameters: {{version: from_file}}}}\n')
    assert "'from_file'" in output_of(f'params_file:={params}')
    assert "'from_argument'" in output_of(f'params_file:={params}', 'version:=from_argument')


def test_chains_is_a_list(needs_launch: None) -> None:
    assert "'third_leg'" in output_of('chains:=[left_leg, third_leg]')


@pytest.mark.parametrize('argument', [
    'chains:=left_leg', 'chains:=[left_leg,]', 'use_sim_time:=maybe', 'publish_tf:=perhaps',
    'params_file:=/no/such/file.yaml', 'log_level:=loud', 'rviz:=please'])
def test_a_bad_argument_is_named_in_one_line(needs_launch: None, argument: str) -> None:
    name, value = argument.split(':=')
    complaints = [line for line in output_of(argument).splitlines() if 'ERROR' in line]
    assert len(complaints) == 1
    assert f'argument {name}: found {value!r}' in complaints[0]


def test_an_argument_that_is_nearly_one_of_ours_is_refused(needs_launch: None) -> None:
    assert "unknown argument 'verson'; did you mean 'version'?" in output_of('verson:=v1')


@pytest.mark.parametrize(('argument', 'told'), [
    ('kinematics_file:=/no/such.yaml', '/no/such.yaml'), ('foot_frame:=toe', "'toe'"),
    ('frame_prefix:=/icub1/', "'/icub1/'")])
def test_the_arguments_reach_the_node(needs_launch: None, argument: str, told: str) -> None:
    assert f'found {told}' in output_of(argument) or told in output_of(argument)


def test_rviz_gets_the_shipped_configuration_in_namespace_and_prefix(needs_launch: None) -> None:
    from importlib.util import module_from_spec, spec_from_file_location
    spec = spec_from_file_location('foot_poses_launch', LAUNCH_FILE)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    command = ' '.join(str(part) for part in module.viewer('robot1', 'icub1/')._Node__arguments)
    assert 'foot_poses.rviz' in command and '-f icub1/root_link' in command
    shown = (LAUNCH_FILE.parents[1] / 'config' / 'foot_poses.rviz').read_text()
    for topic in module.RVIZ_TOPICS:
        assert f'Value: {topic}\n' in shown


def test_without_arguments_the_node_runs_until_sigint_and_ends_cleanly(
        needs_launch: None) -> None:
    with start('namespace:=robot1') as launch:
        assert launch.stdout is not None
        deadline = threading.Timer(TIMEOUT, launch.kill)
        deadline.start()
        next(line for line in launch.stdout if '[robot1.foot_pose_publisher]: publishing' in line)
        launch.send_signal(signal.SIGINT)
        rest = launch.stdout.read()
        deadline.cancel()
    assert 'process has finished cleanly' in rest
    assert 'Traceback' not in rest
