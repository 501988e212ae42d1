"""QoS of the node's topics, changed by parameters `qos_overrides.<topic>.<role>.<policy>`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from icub_leg_fk.errors import ParameterError, UnknownNameError
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions, QoSPolicyKind

PREFIX = 'qos_overrides.'
OVERRIDABLE = QoSOverridingOptions(
    policy_kinds=(
        QoSPolicyKind.HISTORY,
        QoSPolicyKind.DEPTH,
        QoSPolicyKind.RELIABILITY,
        QoSPolicyKind.DURABILITY,
    )
)
_DEPTH = 'depth'
_LARGEST_DEPTH = 2**31 - 1
_CHOICES = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
}


def check_override(name: str, value: Any, roles: Mapping[str, str]) -> None:
    """Refuse what rclpy would pass over in silence or stumble upon.

    Args:
        name: full name of the parameter.
        value: its value.
        roles: `publisher` or `subscription`, by full name of each topic of the node.

    Raises:
        UnknownNameError: the node has no such topic, role or policy.
        ParameterError: the policy cannot have this value.
    """
    entity, _, policy = name.removeprefix(PREFIX).rpartition('.')
    topic, _, role = entity.rpartition('.')
    if topic not in roles:
        topics = [ours for ours, its_role in roles.items() if its_role == role]
        raise UnknownNameError('topic in qos_overrides', topic, topics or roles)
    if role != roles[topic]:
        kind = f'role of {topic} in qos_overrides'
        raise UnknownNameError(kind, role, [roles[topic]])
    if policy == _DEPTH:
        is_allowed = type(value) is int and 1 <= value <= _LARGEST_DEPTH
        allowed = f'an integer from 1 to {_LARGEST_DEPTH}'
    elif policy in _CHOICES:
        names = [choice.name.lower() for choice in _CHOICES[policy]]
        names.remove('unknown')
        is_allowed = value in names
        allowed = ' or '.join(names)
    else:
        policies = (_DEPTH, *_CHOICES)
        raise UnknownNameError('policy in qos_overrides', policy, policies)
    if not is_allowed:
        raise ParameterError(name, f'found {value!r}, allowed: {allowed}')
