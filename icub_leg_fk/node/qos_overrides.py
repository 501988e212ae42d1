"""QoS of the node's topics, changed by parameters `qos_overrides.<topic>.<role>.<policy>`."""

from collections.abc import Mapping
from typing import Any

from icub_leg_fk.errors import ParameterError
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions, QoSPolicyKind

PREFIX = 'qos_overrides.'
OVERRIDABLE = QoSOverridingOptions(policy_kinds=(
    QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY,
    QoSPolicyKind.DURABILITY))
_LARGEST_DEPTH = 2**31 - 1
_CHOICES = {name: [policy.name.lower() for policy in policies if policy.name != 'UNKNOWN']
            for name, policies in (('history', HistoryPolicy), ('reliability', ReliabilityPolicy),
                                   ('durability', DurabilityPolicy))}


def check_qos_override(name: str, value: Any, roles: Mapping[str, str]) -> None:
    """Refuse an override that rclpy would pass over in silence or stumble upon.

    Args:
        name: name of the parameter.
        value: its value.
        roles: `publisher` or `subscription`, by full name of each topic.

    Raises:
        ParameterError: no topic of that name and role, no such policy, or a value it cannot take.
    """
    entity, _, policy = name.removeprefix(PREFIX).rpartition('.')
    entities = [f'{topic}.{role}' for topic, role in roles.items()]
    if entity not in entities:
        raise ParameterError(name, f'no such topic, allowed: {PREFIX} with '
                             f'{", ".join(entities)}')
    if policy == 'depth':
        if type(value) is not int or not 1 <= value <= _LARGEST_DEPTH:
            raise ParameterError(name, f'found {value!r}, '
                                 f'allowed: an integer from 1 to {_LARGEST_DEPTH}')
    elif policy not in _CHOICES:
        raise ParameterError(name, f'no such policy, '
                             f'allowed: depth, {", ".join(_CHOICES)}')
    elif value not in _CHOICES[policy]:
        raise ParameterError(name, f'found {value!r}, '
                             f'allowed: {" or ".join(_CHOICES[policy])}')
