"""The private members of rclpy that cannot be avoided, and why; they stand nowhere else.

`publish_raw`: `Publisher.publish` enters a context and looks at the type of every message, which
at 1 kHz costs as much as a pose does. Where the handle has no such method, `publish` does.

`_parameter_overrides`: rclpy has no public way to list the parameter values given at start,
without which a misspelt name would be ignored in silence.
"""

from collections.abc import Callable, Mapping

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher


def raw_publish(publisher: Publisher) -> Callable[[bytes], None]:
    """Return what publishes the bytes of a message, fast."""
    publish: Callable[[bytes], None] = getattr(
        publisher.handle, 'publish_raw', publisher.publish
    )
    return publish


def parameter_overrides(node: Node) -> Mapping[str, Parameter]:
    """Return the parameter values given at start, declared or not, by name."""
    overrides: Mapping[str, Parameter] = node._parameter_overrides
    return overrides
