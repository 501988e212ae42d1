"""Start `foot_pose_publisher`; what is not given comes from the parameter file, or the defaults.

`ros2 launch icub_leg_fk foot_poses_launch.py version:=v1 chains:='[left_leg]' rviz:=true`
"""

from __future__ import annotations

from pathlib import Path
import re

from icub_leg_fk.errors import closest
from icub_leg_fk.kinematics import config_file
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Parameters set by the argument of the same name: their type, and what the argument means.
PARAMETERS = {
    'version': (str, 'version of every chain that sets none of its own, such as v2_5'),
    'chains': (list[str], "list of the chains to publish, such as '[left_leg, right_leg]'"),
    'kinematics_file': (str, 'another kinematics file; empty is the shipped one'),
    'foot_frame': (str, "a tip frame's name, of the iCub's feet dh or sole"),
    'frame_prefix': (str, 'put before every frame id, such as icub1/'),
    'publish_tf': (bool, 'true to broadcast the poses on /tf, too, or false'),
    'publish_twist': (bool, 'true to publish the velocities of the feet, too, or false'),
    'publish_markers': (bool, 'true to publish the skeletons, too, or false'),
    'use_sim_time': (bool, 'true to take the time from /clock, or false'),
}
OTHERS = {
    'params_file': 'YAML file with node parameters',
    'namespace': 'namespace of the node and of its topics',
    'log_level': 'what the node logs: debug, info, warn, error or fatal',
    'rviz': 'true to open RViz with the poses and the skeletons (publish_markers is then true '
            'unless given), or false',
}
LOG_LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
RVIZ_TOPICS = [f'/foot_pose_publisher/{name}'
               for name in ('left_foot/pose', 'right_foot/pose', 'skeleton')]


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments, all of them optional, and the nodes."""
    arguments = {name: description for name, (_, description) in PARAMETERS.items()} | OTHERS
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value='', description=description)
          for name, description in arguments.items()),
        OpaqueFunction(function=nodes),
    ])


def nodes(context: LaunchContext) -> list[Node]:
    """Return the node, its parameters from the file and then from the arguments; and RViz."""
    refuse_misspelt(context)
    given = {name: LaunchConfiguration(name).perform(context) for name in (*PARAMETERS, *OTHERS)}
    params_file, log_level = given['params_file'], given['log_level']
    if params_file and not Path(params_file).is_file():
        raise RuntimeError(f'argument params_file: found {params_file!r}, allowed: a file')
    if log_level and log_level not in LOG_LEVELS:
        raise RuntimeError(f'argument log_level: found {log_level!r}, allowed: '
                           f'{", ".join(LOG_LEVELS)}')
    if given['rviz'] not in ('', 'true', 'false'):
        raise RuntimeError(f'argument rviz: found {given["rviz"]!r}, allowed: true or false')
    overrides = {name: parameter(context, name) for name in PARAMETERS if given[name]}
    rviz = given['rviz'] == 'true'
    if rviz and not given['publish_markers']:
        overrides['publish_markers'] = True
    # Name and namespace are both given: only then are the overrides written for the node's full
    # name, and only so do they win over a file that names the node as well.
    publisher = Node(
        package='icub_leg_fk',
        executable='foot_pose_publisher',
        name='foot_pose_publisher',
        namespace=LaunchConfiguration('namespace'),
        parameters=[item for item in (params_file, overrides) if item],
        ros_arguments=['--log-level', log_level] if log_level else [],
        output='screen',
    )
    return [publisher, viewer(given['namespace'], given['frame_prefix'])] if rviz else [publisher]


def viewer(namespace: str, frame_prefix: str) -> Node:
    """Return RViz with the shipped configuration, in a namespace and under a frame prefix."""
    inside = f'/{namespace.strip("/")}' if namespace.strip('/') else ''
    return Node(
        package='rviz2',
        executable='rviz2',
        name='foot_poses_rviz',
        arguments=['-d', str(config_file('foot_poses.rviz')), '-f', f'{frame_prefix}root_link'],
        remappings=[(topic, inside + topic) for topic in RVIZ_TOPICS] if inside else [],
    )


def refuse_misspelt(context: LaunchContext) -> None:
    """Refuse an argument whose name is nearly one of ours, which launch would pass over."""
    ours = (*PARAMETERS, *OTHERS)
    for name in context.launch_configurations:
        if name not in ours and (guess := closest(name, ours)):
            raise RuntimeError(f'unknown argument {name!r}; did you mean {guess!r}?')


def parameter(context: LaunchContext, name: str) -> ParameterValue:
    """Return an argument as a parameter of its type."""
    value_type, description = PARAMETERS[name]
    argument = LaunchConfiguration(name)
    found = argument.perform(context)
    value = ParameterValue(argument, value_type=value_type)
    try:
        value.evaluate(context)
        if re.search(r',\s*\]\s*$', found):  # YAML passes over it, and a chain may be missing
            raise ValueError('a comma before the bracket')
    except ValueError as error:
        raise RuntimeError(
            f'argument {name}: found {found!r}, allowed: {description}') from error
    return value
