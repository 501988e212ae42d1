"""The node's parameters: declared with type, description and bounds; changed all or nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
import sys
from typing import Any, NamedTuple

from icub_leg_fk.errors import closest, LegFKError, ParameterError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, Urdf
from icub_leg_fk.kinematics.table_from_urdf import topic_name
from icub_leg_fk.node.arguments import files_for_others, names_given, read_arguments
from icub_leg_fk.node.qos_overrides import check_override, PREFIX
from icub_leg_fk.node.rclpy_private import parameter_overrides
from icub_leg_fk.stream.configuration import (
    Configuration,
    DEFAULT_FRAME,
    DEFAULT_TIMEOUT,
    LEGS,
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
from rclpy.parameter import Parameter as RclpyParameter


class Parameter(NamedTuple):
    """A parameter of the node.

    Attributes:
        name: its name.
        default: its value where none is given; it has the type of all values.
        description: what it means, in a sentence.
        allowed: which values it may have.
        largest: greatest value of a number that is at least 0; None if it is no number.
        is_live: whether it can be changed while the node runs.
    """

    name: str
    default: Any
    description: str
    allowed: str
    largest: float | None = None
    is_live: bool = True

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` shows."""
        descriptor = ParameterDescriptor(
            description=self.description,
            read_only=not self.is_live,
            additional_constraints=self.allowed,
        )
        if self.largest is not None:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=0.0, to_value=self.largest, step=0.0)
            ]
        return descriptor


_YES_OR_NO = 'true or false'
PARAMETERS = (
    Parameter(
        'chains',
        list(LEGS),
        'Chains whose tip poses are published.',
        'a list of chains, each once and with its version if need be, such as '
        '[left_leg, head_imu=v2]',
        is_live=False,
    ),
    Parameter(
        'version',
        '',
        "Version of every chain that is named without one; empty: the file's default.",
        'a version of the kinematics file, such as v2_5; leg_fk list shows them',
    ),
    Parameter(
        'kinematics_file',
        '',
        'Kinematics file or URDF to read; empty: the shipped one.',
        'path of a file; ~ is your home',
        is_live=False,
    ),
    Parameter(
        'description_from_topic',
        False,
        "Compute with the running robot's URDF, which "
        'robot_state_publisher sends on robot_description.',
        'true or false; true without kinematics_file',
        is_live=False,
    ),
    Parameter(
        'root_frame',
        '',
        'Root link, where the kinematics come from a URDF; empty: '
        'root_link, or else the top.',
        'a link of the URDF',
        is_live=False,
    ),
    Parameter(
        'joint_prefix',
        '',
        'Put before every joint name that is looked for, such as icub1/.',
        'printable characters',
        is_live=False,
    ),
    Parameter(
        'foot_frame',
        DEFAULT_FRAME,
        "Axes of the tip: the table's last frame, or the sole.",
        'a tip frame of the kinematics file, such as dh or sole',
    ),
    Parameter(
        'frame_prefix',
        '',
        'Put before every frame id, such as icub1/.',
        'printable, no space, no leading slash',
    ),
    Parameter(
        'joint_timeout',
        DEFAULT_TIMEOUT,
        'How far a joint may lag the newest of its chain '
        'before the chain is held back [s]; 0.0 turns this off.',
        f'a number with a decimal point from 0.0 to {LONGEST_TIMEOUT:.0f}.0',
        LONGEST_TIMEOUT,
    ),
    Parameter(
        'stamp_source',
        STAMP_SOURCES[0],
        "Stamp of the poses: the message's, or the node's "
        "time; a zero message stamp always becomes the node's time.",
        ' or '.join(STAMP_SOURCES),
    ),
    Parameter(
        'publish_tf',
        False,
        'Also broadcast the poses on /tf (needs tf2_msgs).',
        _YES_OR_NO,
    ),
    Parameter(
        'publish_twist', False, 'Also publish the velocity of the tips.', _YES_OR_NO
    ),
    Parameter(
        'publish_markers',
        False,
        'Also publish the skeletons for RViz and Foxglove.',
        _YES_OR_NO,
    ),
)
_OF_THE_CATALOG = ('kinematics_file', 'description_from_topic', 'root_frame')
_RCLPYS_OWN = ('use_sim_time', 'start_type_description_service')
PARAMETER_NAMES = (*(parameter.name for parameter in PARAMETERS), *_RCLPYS_OWN)


class NodeParameters:
    """Declares the node's parameters and turns every valid set of them into a configuration.

    Args:
        node: the node.
        apply: called with each new configuration, after the parameters have been set.

    Attributes:
        configuration: the present configuration.
        description_is_source: whether the kinematics come from the robot's description.

    Raises:
        ParameterError: a parameter given at start cannot be used.
        UnknownNameError: the command line gives a parameter that the node does not have.
        InputFileError: the kinematics file cannot be used.
    """

    def __init__(self, node: Node, apply: Callable[[Configuration], None]) -> None:
        self._node = node
        self._apply = apply
        self._overrides = parameter_overrides(node)
        for parameter in PARAMETERS:
            self._declare(parameter)
        self._arguments = read_arguments(sys.argv)
        self._given = names_given(self._arguments, node.get_fully_qualified_name())
        self.description_is_source = self._value('description_from_topic')
        self._catalog = self._catalog_at_start()
        self.configuration = configuration_of(self._catalog, self._values())
        self._check_unknown()
        self._candidate: Configuration | None = None
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._adopt)

    def use(self, urdf: Urdf) -> None:
        """Work with the robot's description from now on.

        Raises:
            LegFKError: it does not have what is asked for; nothing has changed.
        """
        catalog = self._read_from_root(lambda root: Catalog.from_urdf(urdf, root=root))
        self.configuration = configuration_of(catalog, self._values())
        self._catalog = catalog
        self._apply(self.configuration)

    def _catalog_at_start(self) -> Catalog | None:
        """Return the catalog of the kinematics file; None if a description is to come."""
        file = self._value('kinematics_file')
        if not self.description_is_source:
            return self._read_from_root(lambda root: load_catalog(file, root))
        if file:
            raise ParameterError(
                'description_from_topic',
                f'found true beside kinematics_file {file!r}; allowed: one of them',
            )
        return None

    def _read_from_root(self, read: Callable[[str], Catalog]) -> Catalog:
        """Return a catalog whose poses are given in `root_frame`.

        A link that does not exist is passed over, with a warning, unless the command line names
        it: a file may be for several robots.
        """
        try:
            return read(self._value('root_frame'))
        except UnknownNameError as error:
            if 'root_frame' in self._given:
                raise ParameterError('root_frame', str(error)) from error
            catalog = read('')
            return replace(
                catalog, warnings=(*catalog.warnings, f'root_frame not used: {error}')
            )

    def _declare(self, parameter: Parameter) -> None:
        name = parameter.name
        try:
            self._node.declare_parameter(
                name, parameter.default, parameter.descriptor()
            )
        except ParameterException as error:
            found = self._overrides[name].value
            raise ParameterError(
                name, f'found {found!r}, allowed: {parameter.allowed}'
            ) from error

    def _check_unknown(self) -> None:
        """Look at what rclpy passes over: parameters that the node does not have, and bad QoS.

        Those of the command line are refused; those of files, which may be for all nodes, are
        named once.
        """
        log = self._node.get_logger()
        ignored = self._ignored()
        if ignored:
            log.warning(
                f'ignored parameters that this node does not have: {", ".join(ignored)}'
            )
        node = self._node.get_fully_qualified_name()
        for line in files_for_others(self._arguments, node):
            log.warning(line)

    def _ignored(self) -> list[str]:
        """Return what files hold that the node does not have; refuse it on the command line."""
        roles = self._roles()
        ignored = []
        for name, override in self._overrides.items():
            try:
                if name.startswith(PREFIX):
                    check_override(name, override.value, roles)
                elif name not in PARAMETER_NAMES:
                    raise UnknownNameError('parameter', name, PARAMETER_NAMES)
            except UnknownNameError as error:
                if name in self._given:
                    raise
                guess = closest(error.name, error.choices)
                ignored.append(f'{name} (did you mean {guess}?)' if guess else name)
        return ignored

    def _roles(self) -> dict[str, str]:
        """Return `publisher` or `subscription` by full name of each topic whose QoS can change."""
        tips = [chain.tip for chain in self.configuration.chains]
        shipped = Catalog.load()
        for awaited in self.configuration.awaited:
            name, _ = shipped.split(awaited)
            is_link = name not in shipped.chains
            tips.append(topic_name(name) if is_link else shipped.chains[name].tip)
        topics = ['~/skeleton']
        for tip in tips:
            topics += [f'~/{tip}/pose', f'~/{tip}/twist']
        resolve = self._node.resolve_topic_name
        roles = dict.fromkeys(map(resolve, topics), 'publisher')
        return {resolve('joint_states'): 'subscription'} | roles

    def _values(self) -> dict[str, Any]:
        return {parameter.name: self._value(parameter.name) for parameter in PARAMETERS}

    def _value(self, name: str) -> Any:
        try:
            return self._node.get_parameter(name).value
        except ParameterUninitializedException:  # so rclpy takes an empty list
            return ()

    def _check(self, changes: Sequence[RclpyParameter]) -> SetParametersResult:
        """Refuse a set of changes that gives no valid configuration; changes nothing."""
        self._candidate = None
        values = self._values()
        ours = {
            change.name: change.value for change in changes if change.name in values
        }
        if ours:
            try:
                self._candidate = configuration_of(self._catalog, values | ours)
            except LegFKError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _adopt(self, changes: Sequence[RclpyParameter]) -> None:
        """Work with what `_check` has found valid."""
        if self._candidate is not None:
            self.configuration = self._candidate
            self._candidate = None
            self._apply(self.configuration)


def load_catalog(kinematics_file: str, root_frame: str = '') -> Catalog:
    """Return the catalog that values of these parameters name.

    Raises:
        InputFileError: the file cannot be used.
        UnknownNameError: it is a URDF without such a link.
    """
    path = Path(kinematics_file).expanduser() if kinematics_file else None
    return Catalog.load(path, root=root_frame)


def configuration_of(
    catalog: Catalog | None, values: Mapping[str, Any]
) -> Configuration:
    """Return the configuration of parameter values by name.

    Raises:
        ParameterError: a value cannot be used.
    """
    if values['publish_tf'] and find_spec('tf2_msgs') is None:
        raise ParameterError(
            'publish_tf',
            'found true, but tf2_msgs, which ROS 2 has, is not '
            'installed; allowed: false',
        )
    others = {
        name: value for name, value in values.items() if name not in _OF_THE_CATALOG
    }
    return Configuration.checked(catalog, **others)
