"""Start `foot_pose_publisher`; what is not given comes from the parameter file, or the defaults.

`ros2 launch icub_leg_fk foot_poses_launch.py chains:='[left_leg, head_imu=v2]' rviz:=true`
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
import sys
from tempfile import NamedTemporaryFile
from typing import Any

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from icub_leg_fk.errors import closest, LegFKError, UnknownNameError
from icub_leg_fk.node.arguments import parameters_for
from icub_leg_fk.node.parameters import (
    configuration_of,
    load_catalog,
    Parameter,
    PARAMETERS,
)
from icub_leg_fk.tools.rviz_config import rviz_config
from launch import LaunchContext, LaunchDescription, Substitution
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch.logging import get_logger
from launch.substitutions import TextSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.utilities import make_namespace_absolute, prefix_namespace

NAME = 'foot_pose_publisher'
SIM_TIME = Parameter(
    'use_sim_time', False, 'Take the time from /clock.', 'true or false'
)
AS_PARAMETERS = (*PARAMETERS, SIM_TIME)
ARGUMENTS = (
    *AS_PARAMETERS,
    Parameter('joint_states', 'joint_states', 'Topic of the joint states.', 'a topic'),
    Parameter(
        'params_file',
        '',
        'YAML file with node parameters; an argument given here wins over it.',
        'a file',
    ),
    Parameter('namespace', '', 'Namespace of the node and its topics.', 'a namespace'),
    Parameter(
        'log_level',
        'info',
        'What the node logs.',
        'debug, info, warn, error or fatal',
    ),
    Parameter(
        'rviz',
        False,
        'Open RViz with the poses and the skeletons, for which publish_markers is '
        'then true unless given.',
        'true or false',
    ),
)
NAMES = [argument.name for argument in ARGUMENTS]
TRUTH = {'true': True, '1': True, 'false': False, '0': False, '': False}


class Unset(Substitution):
    """The default of an argument: nothing, but shown as what then counts.

    Args:
        shown: the value that counts where neither argument nor parameter file gives one.
    """

    def __init__(self, shown: str) -> None:
        super().__init__()
        self._shown = shown

    def describe(self) -> str:
        """Return what `--show-args` shows."""
        return repr(self._shown)

    def perform(self, context: LaunchContext) -> str:
        """Return that nothing is given."""
        return ''


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments, all of them optional, and the nodes."""
    declared = []
    for argument in ARGUMENTS:
        description = f'{argument.description} Allowed: {argument.allowed}.'
        default = Unset(written(argument.default))
        declared.append(
            DeclareLaunchArgument(
                argument.name, default_value=default, description=description
            )
        )
    # In a group of its own nothing that is declared here is left behind for other launch files.
    return LaunchDescription([GroupAction([*declared, OpaqueFunction(function=nodes)])])


def written(value: Any) -> str:
    """Return a parameter's value as an argument is written."""
    if isinstance(value, list):
        return f'[{", ".join(value)}]'
    return str(value).lower() if isinstance(value, bool) else str(value)


def nodes(context: LaunchContext) -> list[Node]:
    """Return the node, its parameters from the file and then from the arguments; and RViz."""
    refuse_misspelt(sys.argv)
    given = {name: context.launch_configurations[name] for name in NAMES}
    parameters: dict[str, ParameterValue] = {}
    for parameter in AS_PARAMETERS:
        found = given[parameter.name]
        if found:
            parameters[parameter.name] = parameter_value(parameter, found, context)
    params_file = checked_file(given['params_file'])
    with_rviz = truth('rviz', given['rviz'])
    if with_rviz:
        parameters.setdefault('publish_markers', ParameterValue(True, value_type=bool))
    node = full_name(context, given['namespace'])
    started = [publisher(given, params_file, parameters)]
    if with_rviz:
        values = {name: value.evaluate(context) for name, value in parameters.items()}
        started += viewer(node, params_file, values)
    return started


def publisher(
    given: Mapping[str, str], params_file: str, parameters: Mapping[str, ParameterValue]
) -> Node:
    """Return the node.

    Name and namespace are both given: only then are the parameters written for the node's full
    name, and only so do they win over a file that names the node as well.
    """
    log_level, topic = given['log_level'], given['joint_states']
    return Node(
        package='icub_leg_fk',
        executable=NAME,
        name=NAME,
        namespace=given['namespace'],
        parameters=[item for item in (params_file, dict(parameters)) if item],
        remappings=[('joint_states', topic)] if topic else [],
        ros_arguments=['--log-level', log_level] if log_level else [],
        output='screen',
    )


def viewer(node: str, params_file: str, given: Mapping[str, Any]) -> list[Node]:
    """Return RViz for what the node publishes; nothing where it is refused, or RViz is missing."""
    values = {parameter.name: parameter.default for parameter in PARAMETERS}
    try:
        if params_file:
            values |= parameters_for(params_file, node)
        values |= given
        ours = {parameter.name: values[parameter.name] for parameter in PARAMETERS}
        file, root_frame = ours['kinematics_file'], ours['root_frame']
        is_described = ours['description_from_topic']
        catalog = None if is_described else load_catalog(file, root_frame)
        configuration = configuration_of(catalog, ours)
    except (LegFKError, TypeError, AttributeError):  # the node says what is wrong
        return []
    if is_described and file:  # which it refuses as well
        return []
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        get_logger(NAME).warning('RViz is not installed; the node runs without it')
        return []
    with NamedTemporaryFile(
        'w', prefix='foot_poses_', suffix='.rviz', delete=False
    ) as config:
        config.write(rviz_config(configuration, node, root_frame))
    return [
        Node(
            package='rviz2',
            executable='rviz2',
            name='foot_poses_rviz',
            arguments=['-d', config.name],
        )
    ]


def full_name(context: LaunchContext, namespace: str) -> str:
    """Return the full name of the node, in a namespace that a launch file has pushed or not."""
    pushed = context.launch_configurations.get('ros_namespace')
    return (
        make_namespace_absolute(prefix_namespace(pushed, namespace)).rstrip('/')
        + f'/{NAME}'
    )


def refuse_misspelt(argv: Sequence[str]) -> None:
    """Refuse an argument of nearly one of our names, which launch would pass over.

    Only where this very file is launched: the arguments of another that includes it are its own.
    """
    if Path(__file__).name not in [Path(word).name for word in argv]:
        return
    for word in argv:
        name, assigns, _ = word.partition(':=')
        if assigns and name not in NAMES and closest(name, NAMES):
            raise RuntimeError(str(UnknownNameError('argument', name, NAMES)))


def parameter_value(
    parameter: Parameter, found: str, context: LaunchContext
) -> ParameterValue:
    """Return an argument as a parameter of its type."""
    kind = type(parameter.default)
    if kind is bool:
        return ParameterValue(truth(parameter.name, found), value_type=bool)
    text = TextSubstitution(text=found)
    value = ParameterValue(text, value_type=list[str] if kind is list else kind)
    try:
        value.evaluate(context)
        if kind is list and found.replace(' ', '').endswith(',]'):
            raise ValueError('YAML passes over this comma, and a chain may be missing')
    except ValueError as error:
        raise refusal(parameter.name, found, parameter.allowed) from error
    return value


def truth(name: str, found: str) -> bool:
    """Return what an argument says, as launch reads conditions."""
    try:
        return TRUTH[found.strip().lower()]
    except KeyError as error:
        raise refusal(name, found, 'true or false') from error


def checked_file(params_file: str) -> str:
    """Return the path of the parameter file, which launch would pass over if there is none."""
    if not params_file:
        return ''
    file = Path(params_file).expanduser()
    if not file.is_file():
        raise refusal('params_file', params_file, 'a file')
    return str(file)


def refusal(name: str, found: str, allowed: str) -> RuntimeError:
    """Return the error that ends the launch."""
    return RuntimeError(f'argument {name}: found {found!r}, allowed: {allowed}')
