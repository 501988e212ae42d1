"""Start `foot_pose_publisher`; what is not given comes from the parameter file, or the defaults.

`ros2 launch icub_leg_fk foot_poses_launch.py version:=v1 chains:='[left_leg]'`
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Parameters set by the argument of the same name: their type, and what the argument means.
PARAMETERS = {
    'version': (str, 'version of every chain that sets none of its own, such as v2_5'),
    'chains': (list[str], "list of the chains to publish, such as '[left_leg, right_leg]'"),
    'use_sim_time': (bool, 'true to take the time from /clock, or false'),
}


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments, all of them optional, and the one node."""
    arguments = {name: description for name, (_, description) in PARAMETERS.items()}
    arguments['params_file'] = 'YAML file with node parameters'
    arguments['namespace'] = 'namespace of the node and of its topics'
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value='', description=description)
          for name, description in arguments.items()),
        OpaqueFunction(function=foot_pose_publisher),
    ])


def foot_pose_publisher(context: LaunchContext) -> list[Node]:
    """Return the node, its parameters from the file first and from the arguments last."""
    params_file = LaunchConfiguration('params_file').perform(context)
    if params_file and not Path(params_file).is_file():
        raise RuntimeError(f'argument params_file: found {params_file!r}, allowed: a file')
    overrides = {name: parameter(context, name) for name in PARAMETERS
                 if LaunchConfiguration(name).perform(context)}
    # Name and namespace are both given: only then are the overrides written for the node's full
    # name, and only so do they win over a file that names the node as well.
    return [Node(
        package='icub_leg_fk',
        executable='foot_pose_publisher',
        name='foot_pose_publisher',
        namespace=LaunchConfiguration('namespace'),
        parameters=[item for item in (params_file, overrides) if item],
        output='screen',
    )]


def parameter(context: LaunchContext, name: str) -> ParameterValue:
    """Return an argument as a parameter of its type."""
    value_type, description = PARAMETERS[name]
    argument = LaunchConfiguration(name)
    value = ParameterValue(argument, value_type=value_type)
    try:
        value.evaluate(context)
    except ValueError as error:
        found = argument.perform(context)
        raise RuntimeError(
            f'argument {name}: found {found!r}, allowed: {description}') from error
    return value
