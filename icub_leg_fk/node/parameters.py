"""The node's parameters: declared with type, description and bounds; changed all or nothing."""

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

from icub_leg_fk.errors import closest, LegFKError, ParameterError
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.node.qos_overrides import check_qos_override, PREFIX
from icub_leg_fk.stream.configuration import (
    Configuration,
    DEFAULT_TIMEOUT,
    LONGEST_TIMEOUT,
    STAMP_SOURCES,
)
from rcl_interfaces.msg import (
    FloatingPointRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter


class _Parameter(NamedTuple):
    name: str
    default: Any
    description: str
    constraints: str = ''
    largest: float | None = None
    read_only: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` shows."""
        descriptor = ParameterDescriptor(description=self.description,
                                         additional_constraints=self.constraints,
                                         read_only=self.read_only)
        if self.largest is not None:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=0.0, to_value=self.largest, step=0.0)]
        return descriptor


_PARAMETERS = (
    _Parameter('chains', ['left_leg', 'right_leg'], 'Chains whose tip poses are published.',
               'a list of chains of the kinematics file, each once, such as [left_leg, head_imu=v2]',
               read_only=True),
    _Parameter('version', '', 'Version of every chain that is named without one; empty: its default.',
               'a version of the kinematics file, such as v2_5 (leg_fk list shows them)'),
    _Parameter('kinematics_file', '', 'Kinematics file to read; empty is the shipped one.',
               'path of a YAML file', read_only=True),
    _Parameter('foot_frame', 'dh', "Axes of the tip: the table's last frame, or the sole.",
               'a tip frame of the kinematics file, such as dh or sole'),
    _Parameter('frame_prefix', '', 'Put before every frame id.',
               'printable, no space, no leading slash'),
    _Parameter('joint_timeout', DEFAULT_TIMEOUT, 'Age of a joint beside the newest of its chain '
               'above which the chain is held back [s]; 0 turns this off.', '', LONGEST_TIMEOUT),
    _Parameter('stamp_source', 'message', "Stamp of the poses: the message's, or the node's "
               "time; a zero message stamp always becomes the node's time.",
               ' or '.join(STAMP_SOURCES)),
    _Parameter('publish_tf', False, 'Also broadcast the poses on /tf (needs tf2_msgs).'),
    _Parameter('publish_twist', False, 'Also publish the velocity of the tips.'),
    _Parameter('publish_markers', False, 'Also publish the skeletons for RViz and Foxglove.'),
)
_RCLPYS_OWN = ('use_sim_time', 'start_type_description_service')
_COMMON_ELSEWHERE = ('frame_id', 'root_frame', 'base_frame', 'tf_prefix', 'publish_rate',
                     'robot_description', 'joints')
"""Names that other nodes have: in a file for all nodes they are theirs, not ours misspelt."""


def is_parameter_name(name: str) -> bool:
    """Return whether this is the name of a parameter of the node, or nearly so."""
    names = [parameter.name for parameter in _PARAMETERS]
    return (name in (*names, *_RCLPYS_OWN) or name.startswith(PREFIX)
            or closest(name, names) is not None)


class NodeParameters:
    """Declares the node's parameters and turns every valid set of them into a configuration.

    Args:
        node: the node.
        apply: called with each new configuration, after the parameters have been set.

    Attributes:
        configuration: the present configuration.

    Raises:
        ParameterError: a parameter given at start is unknown or cannot be used.
        CatalogError: the kinematics file cannot be used.
    """

    def __init__(self, node: Node, apply: Callable[[Configuration], None]) -> None:
        self._node = node
        self._apply = apply
        self._declaring = True
        for parameter in _PARAMETERS:
            self._declare(parameter)
        self._catalog = Catalog.load(node.get_parameter('kinematics_file').value or None)
        self._check_overrides()
        self.configuration = _configuration(self._catalog, self._values())
        self._declaring = False
        self._candidate: Configuration | None = None
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._adopt)

    def _declare(self, parameter: _Parameter) -> None:
        try:
            self._node.declare_parameter(parameter.name, parameter.default,
                                         parameter.descriptor())
        except ParameterException as error:
            overrides = self._node._parameter_overrides
            raise ParameterError(
                parameter.name, f'found {overrides[parameter.name].value!r}, allowed: '
                f'{parameter.constraints or _kind(parameter)}') from error

    def _check_overrides(self) -> None:
        """Refuse overrides that rclpy would pass over in silence: misspelt ones and bad QoS.

        A file for all nodes holds other nodes' parameters, too; that they are passed over is said.
        """
        known = [*(parameter.name for parameter in _PARAMETERS), *_RCLPYS_OWN]
        resolve = self._node.resolve_topic_name
        roles = {resolve('joint_states'): 'subscription'}
        roles |= {resolve(f'~/{entry.tip}/{kind}'): 'publisher'
                  for entry in self._catalog.chains.values() for kind in ('pose', 'twist')}
        roles[resolve('~/skeleton')] = 'publisher'
        foreign = []
        for name, override in self._node._parameter_overrides.items():
            if name.startswith(PREFIX):
                check_qos_override(name, override.value, roles)
            elif name not in known:
                if name not in _COMMON_ELSEWHERE and (guess := closest(name, known)):
                    raise ParameterError(
                        f'unknown parameter {name!r}; did you mean {guess!r}?')
                foreign.append(name)
        if foreign:
            self._node.get_logger().warning(
                f'passed over parameters that are not of this node: {", ".join(foreign)}')

    def _values(self) -> dict[str, Any]:
        return {parameter.name: self._value(parameter.name) for parameter in _PARAMETERS}

    def _value(self, name: str) -> Any:
        try:
            return self._node.get_parameter(name).value
        except ParameterUninitializedException:  # rclpy takes an empty list for no value
            return None

    def _check(self, changes: Sequence[Parameter]) -> SetParametersResult:
        """Refuse a set of changes that gives no valid configuration; changes nothing."""
        self._candidate = None
        if self._declaring:
            return SetParametersResult(successful=True)
        values = self._values()
        ours = [change for change in changes if change.name in values]
        if not ours:
            return SetParametersResult(successful=True)
        values |= {change.name: change.value for change in ours}
        try:
            self._candidate = _configuration(self._catalog, values)
        except LegFKError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _adopt(self, changes: Sequence[Parameter]) -> None:
        """Take over what `_check` has found valid."""
        if self._candidate is None:
            return
        self.configuration, self._candidate = self._candidate, None
        self._apply(self.configuration)


def _configuration(catalog: Catalog, values: Mapping[str, Any]) -> Configuration:
    """Return the configuration of parameter values by name."""
    others = {name: value for name, value in values.items() if name != 'kinematics_file'}
    if others['publish_tf'] and find_spec('tf2_msgs') is None:
        raise ParameterError('publish_tf', 'found true without the Python module tf2_msgs; '
                             'allowed: false, or install tf2_msgs, which ROS 2 has')
    return Configuration.checked(catalog, **others)


def _kind(parameter: _Parameter) -> str:
    if parameter.largest is not None:
        return f'a number with a decimal point from 0.0 to {parameter.largest}'
    return 'true or false'
