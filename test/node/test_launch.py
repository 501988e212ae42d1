"""The launch file starts the node, and RViz, with what its arguments say."""

import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import threading

from icub_leg_fk.node.parameters import PARAMETERS
import pytest
import yaml

# Asked for first, since the folder of this name in a clone can be imported as `launch`.
ros_actions = pytest.importorskip(
    'launch_ros.actions', reason='launch_ros is not installed; ROS 2 brings it'
)
launch, actions, sources, substitutions = map(
    pytest.importorskip,
    (
        'launch',
        'launch.actions',
        'launch.launch_description_sources',
        'launch.substitutions',
    ),
)

LAUNCH_FILE = Path(__file__).resolve().parents[2] / 'launch/foot_poses_launch.py'
SOURCE = sources.PythonLaunchDescriptionSource(str(LAUNCH_FILE))
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}
TIMEOUT = 90  # s

SHOW = """#!/bin/sh
exec >&2
echo "STARTED {name}: $*"
for word in "$@"; do case "$word" in /*) test -f "$word" && sed 's/^/| /' "$word"; esac; done
"""
NODE = f'#!/bin/sh\nexec {sys.executable} -m icub_leg_fk.node.main "$@"\n'

# What `ros2 launch FILE NAME:=VALUE ...` does, without ros2cli.
ROS2_LAUNCH = f"""
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
arguments = [argument.split(':=') for argument in sys.argv[2:]]
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource({str(LAUNCH_FILE)!r}), launch_arguments=arguments)]))
sys.exit(service.run())
"""


def install(prefix, package, executable, script):
    """Put a package with one executable where launch looks for it."""
    index = prefix / 'share/ament_index/resource_index/packages'
    place = prefix / 'lib' / package
    for folder in (index, place):
        folder.mkdir(parents=True, exist_ok=True)
    (index / package).touch()
    (place / executable).write_text(script)
    (place / executable).chmod(0o755)


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Return where packages are, with a node and an RViz that show what they are started with."""
    install(tmp_path, 'icub_leg_fk', 'foot_pose_publisher', SHOW.format(name='node'))
    install(tmp_path, 'rviz2', 'rviz2', SHOW.format(name='rviz2'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    return tmp_path


@pytest.fixture
def launched(prefix, capfd):
    """Return a function that launches actions and returns all that is said meanwhile."""
    launch.logging.reset()  # it writes to where standard output was when it began

    def run(*started):
        service = launch.LaunchService(noninteractive=True)
        service.include_launch_description(launch.LaunchDescription(started))
        service.run()
        out, err = capfd.readouterr()
        assert 'Traceback' not in out + err
        return out + err

    return run


def include(**arguments):
    return actions.IncludeLaunchDescription(SOURCE, launch_arguments=arguments.items())


def shown(output, program):
    """Return what the YAML files hold that the processes of a program were started with."""
    texts = {}
    for process, line in re.findall(
        rf'^\[({program}-\d+)\] \| (.*)$', output, re.MULTILINE
    ):
        texts[process] = texts.get(process, '') + line + '\n'
    held = {}
    for text in texts.values():
        held |= yaml.safe_load(text)
    return held


def parameters(output):
    """Return the parameters that the node was started with, by its full name."""
    sections = shown(output, 'foot_pose_publisher')
    return {node: section['ros__parameters'] for node, section in sections.items()}


def rviz(output):
    """Return the configuration that RViz was started with."""
    return shown(output, 'rviz2')['Visualization Manager']


def topics(manager):
    """Return the topics that RViz subscribes to."""
    return [
        display['Topic']['Value']
        for display in manager['Displays']
        if 'Topic' in display
    ]


def test_show_args_has_every_parameter_with_its_default_and_meaning():
    declared = (
        SOURCE.try_get_launch_description_without_context().get_launch_arguments()
    )
    arguments = {argument.name: argument for argument in declared}
    assert set(arguments) == {
        *DEFAULTS,
        'use_sim_time',
        'joint_states',
        'params_file',
        'namespace',
        'log_level',
        'rviz',
    }
    for name, default in DEFAULTS.items():
        [shown_default] = arguments[name].default_value
        assert (
            yaml.safe_load(yaml.safe_load(shown_default.describe()) or '""') == default
        )
    for parameter in PARAMETERS:
        description = arguments[parameter.name].description
        assert description == f'{parameter.description} Allowed: {parameter.allowed}.'


def test_without_arguments_the_node_gets_no_parameter(launched):
    output = launched(include())
    assert '-r __node:=foot_pose_publisher' in output
    assert parameters(output) == {}
    assert 'rviz2' not in output


def test_arguments_reach_the_node(launched):
    given = {
        'version': '2',
        'chains': '[left_leg, right_leg, head_imu=v2]',
        'frame_prefix': 'icub1/',
        'kinematics_file': '~/robot.yaml',
        'description_from_topic': 'false',
        'root_frame': 'base_link',
        'joint_prefix': 'icub1/',
        'foot_frame': 'sole',
        'joint_timeout': '1',
        'stamp_source': 'now',
        'publish_tf': 'True',
        'publish_twist': '1',
        'publish_markers': 'false',
        'use_sim_time': 'true',
    }
    assert set(DEFAULTS) <= set(given)
    output = launched(include(joint_states='/icub/joints', log_level='debug', **given))
    assert '-r joint_states:=/icub/joints' in output
    assert '--ros-args --log-level debug' in output
    assert parameters(output) == {
        '/foot_pose_publisher': given
        | {
            'chains': ['left_leg', 'right_leg', 'head_imu=v2'],
            'description_from_topic': False,
            'joint_timeout': 1.0,
            'publish_tf': True,
            'publish_twist': True,
            'publish_markers': False,
            'use_sim_time': True,
        }
    }


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('chains', 'left_leg'),
        ('chains', '[left_leg,]'),
        ('joint_timeout', 'soon'),
        ('use_sim_time', 'maybe'),
        ('publish_tf', 'perhaps'),
        ('params_file', '/no/such/file.yaml'),
        ('rviz', 'please'),
    ],
)
def test_a_bad_argument_is_named_in_one_line(launched, name, value):
    complaints = [
        line
        for line in launched(include(**{name: value})).splitlines()
        if 'ERROR' in line
    ]
    assert len(complaints) == 1
    assert f'argument {name}: found {value!r}, allowed: ' in complaints[0]


def test_a_misspelt_argument_is_refused_where_this_file_is_launched(
    launched, monkeypatch
):
    line = 'ros2 launch icub_leg_fk foot_poses_launch.py'.split()
    monkeypatch.setattr(sys, 'argv', [*line, 'rviz2:=true', 'verson:=v1'])
    assert "unknown argument 'rviz2'; did you mean 'rviz'? known: chains," in launched(
        include()
    )
    monkeypatch.setattr(sys, 'argv', [*line, 'version:=v1', 'robot:=icub'])
    assert 'STARTED node' in launched(include())


def test_a_bringup_has_arguments_of_its_own(launched, monkeypatch):
    line = 'ros2 launch bringup robot_launch.py rviz2:=1'.split()
    monkeypatch.setattr(sys, 'argv', line)
    own = {
        'param_file': '/no/such.yaml',
        'rviz2': 'please',
        'verson': 'v1',
        'rviz': 'True',
    }
    of_parent = [
        actions.SetLaunchConfiguration(name, value) for name, value in own.items()
    ]
    output = launched(*of_parent, include())
    assert 'STARTED node' in output
    assert 'STARTED rviz2' in output
    assert 'did you mean' not in output


def test_nothing_that_is_declared_is_left_behind(launched):
    names = ('rviz', 'version', 'use_sim_time')
    found = [
        substitutions.LaunchConfiguration(name, default='unset ') for name in names
    ]
    assert 'then unset unset unset' in launched(
        include(), actions.LogInfo(msg=['then ', *found])
    )


def robot(pushed, **arguments):
    return actions.GroupAction(
        [ros_actions.PushRosNamespace(pushed), include(**arguments)]
    )


def test_the_two_robots_of_the_documentation_have_their_own_versions(prefix, launched):
    share = prefix / 'share/icub_leg_fk'
    share.mkdir()
    (share / 'launch').symlink_to(LAUNCH_FILE.parent)
    page = (LAUNCH_FILE.parents[1] / 'docs/node.md').read_text()
    names = {}
    exec(re.search(r'^```python\n(.*?)^```', page, re.DOTALL | re.MULTILINE)[1], names)
    assert parameters(launched(names['generate_launch_description']())) == {
        '/icub1/foot_pose_publisher': {'version': 'v2_5', 'frame_prefix': 'icub1/'},
        '/icub2/foot_pose_publisher': {'version': 'v3', 'frame_prefix': 'icub2/'},
    }


def test_each_robot_is_included_with_its_own_namespace_and_version(launched):
    output = launched(
        robot('icub1', version='v1', frame_prefix='icub1/'),
        robot('icub2', namespace='feet'),
        robot(
            'icub3',
            chains='[left_leg=v1, right_leg]',
            rviz='true',
            publish_markers='false',
        ),
    )
    assert output.count('STARTED node') == 3
    assert '__ns:=/icub2/feet' in output
    assert parameters(output) == {
        '/icub1/foot_pose_publisher': {'version': 'v1', 'frame_prefix': 'icub1/'},
        '/icub3/foot_pose_publisher': {
            'chains': ['left_leg=v1', 'right_leg'],
            'publish_markers': False,
        },
    }
    assert topics(rviz(output)) == [
        f'/icub3/foot_pose_publisher/{name}'
        for name in ('skeleton', 'left_foot/pose', 'right_foot/pose')
    ]


# The node refuses what it does not know, so its complaint shows what has reached it.
@pytest.mark.parametrize(
    'section', ['/**', '/foot_pose_publisher', '/**/foot_pose_publisher']
)
def test_an_argument_wins_over_the_parameter_file(prefix, launched, section):
    install(prefix, 'icub_leg_fk', 'foot_pose_publisher', NODE)
    file = prefix / 'params.yaml'
    file.write_text(
        f'{section}: {{ros__parameters: {{version: of_file, foot_frame: of_file}}}}\n'
    )
    output = launched(include(params_file=str(file), version='v1', rviz='true'))
    assert "foot_frame: found 'of_file', allowed: dh or sole" in output
    assert 'STARTED rviz2' not in output


def test_rviz_shows_what_is_published(prefix, launched):
    file = prefix / 'params.yaml'
    file.write_text(
        '/**:\n  ros__parameters: {chains: [panda], kinematics_file: %s}\n'
        % (LAUNCH_FILE.parents[1] / 'config/examples/panda.yaml')
    )
    output = launched(
        include(params_file=str(file), namespace='lab', frame_prefix='a/', rviz='true')
    )
    assert parameters(output)['/lab/foot_pose_publisher'] == {
        'frame_prefix': 'a/',
        'publish_markers': True,
    }
    manager = rviz(output)
    assert manager['Global Options']['Fixed Frame'] == 'a/panda_link0'
    assert topics(manager) == [
        '/lab/foot_pose_publisher/skeleton',
        '/lab/foot_pose_publisher/flange/pose',
    ]


def test_rviz_waits_for_the_tips_of_a_description(launched):
    given = {'chains': '[left_leg, toe]', 'description_from_topic': 'true'}
    manager = rviz(launched(include(rviz='true', root_frame='base', **given)))
    assert manager['Global Options']['Fixed Frame'] == 'base'
    assert topics(manager) == [
        f'/foot_pose_publisher/{name}'
        for name in ('skeleton', 'left_foot/pose', 'toe/pose')
    ]


@pytest.mark.parametrize(
    ('name', 'value'), [('version', 'v3'), ('kinematics_file', 'robot.urdf')]
)
def test_rviz_is_not_opened_for_what_the_node_refuses(launched, name, value):
    given = {name: value, 'description_from_topic': 'true'}
    assert 'STARTED rviz2' not in launched(include(rviz='true', **given))


def test_without_rviz_the_node_runs(prefix, launched, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    (prefix / 'share/ament_index/resource_index/packages/rviz2').unlink()
    output = launched(include(rviz='true'))
    assert (
        '[WARNING] [foot_pose_publisher]: RViz is not installed; the node runs'
        in output
    )
    assert 'STARTED node' in output


def test_the_node_runs_until_sigint_and_ends_cleanly(prefix):
    install(prefix, 'icub_leg_fk', 'foot_pose_publisher', NODE)
    command = [
        sys.executable,
        '-c',
        ROS2_LAUNCH,
        LAUNCH_FILE,
        'namespace:=robot1',
        'version:=v1',
    ]
    with subprocess.Popen(
        command,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:
        deadline = threading.Timer(TIMEOUT, process.kill)
        deadline.start()
        line = next(line for line in process.stdout if 'publishing' in line)
        os.killpg(
            process.pid, signal.SIGINT
        )  # as a terminal does: to launch and to the node
        rest = process.stdout.read()
        deadline.cancel()
    assert re.search(r'\[robot1\.foot_pose_publisher\]: .*left_leg=v1', line)
    assert 'process has finished cleanly' in rest
    assert 'Traceback' not in rest
