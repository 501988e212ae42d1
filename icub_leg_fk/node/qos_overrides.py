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
_LARGEST_DEPTH = 2**31 - 1
_POLICIES = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
}


class QoSOverrides:
    """What may be overridden of a node's topics.

    Args:
        roles: `publisher` or `subscription`, by full name of each topic.
    """

    def __init__(self, roles: Mapping[str, str]) -> None:
        self._roles = dict(roles)

    def has(self, name: str) -> bool:
        """Return whether a parameter is for a topic of the node."""
        topic, role, _ = _parts(name)
        return self._roles.get(topic) == role

    def unknown(self, name: str) -> UnknownNameError:
        """Return the error for a parameter that is not for a topic of the node."""
        topic, role, _ = _parts(name)
        if topic in self._roles:
            kind = f'role of {topic} in qos_overrides'
            return UnknownNameError(kind, role, [self._roles[topic]])
        topics = [ours for ours, its_role in self._roles.items() if its_role == role]
        return UnknownNameError('topic in qos_overrides', topic, topics or self._roles)

    def check(self, name: str, value: Any) -> None:
        """Refuse a policy or a value that rclpy would pass over in silence or stumble upon.

        Raises:
            ParameterError: no such policy, or a value it cannot take.
        """
        _, _, policy = _parts(name)
        if policy == 'depth':
            if type(value) is not int or not 1 <= value <= _LARGEST_DEPTH:
                raise ParameterError(
                    name,
                    f'found {value!r}, allowed: an integer from 1 to {_LARGEST_DEPTH}',
                )
            return
        if policy not in _POLICIES:
            raise ParameterError(
                name, f'no such policy; allowed: depth, {", ".join(_POLICIES)}'
            )
        choices = [
            choice.name.lower()
            for choice in _POLICIES[policy]
            if choice.name != 'UNKNOWN'
        ]
        if value not in choices:
            raise ParameterError(
                name, f'found {value!r}, allowed: {" or ".join(choices)}'
            )


def _parts(name: str) -> tuple[str, str, str]:
    """Return topic, role and policy of a parameter's name."""
    entity, _, policy = name.removeprefix(PREFIX).rpartition('.')
    topic, _, role = entity.rpartition('.')
    return topic, role, policy
