"""A running robot in the viewer: the joint states that come over ROS 2."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Lock, Thread
import time
from typing import Any

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.stream.notes import Note, notes_of
from icub_leg_fk.tools.ros import import_ros
from icub_leg_fk.tools.viewer_page import Changed, Posture
import numpy as np

DEFAULT_TOPIC = 'joint_states'
_DEPTH = 100
_LOOK_PERIOD = 1.0  # s
_NO_TRAIL = np.zeros((0, 3))


class LiveJoints:
    """Moves the chains as joint states say, by the node's own rules.

    Args:
        chains: the chains.
        topic: topic of the joint states.
    """

    is_moving = True

    def __init__(self, chains: Sequence[Chain], topic: str) -> None:
        self._topic = topic
        self._input = JointInput(time.time_ns)
        self._input.configure(chains, DEFAULT_TIMEOUT)
        self._newest: dict[
            str, tuple[Sequence[float], float]
        ] = {}  # q, and when it came [s]
        self._notes: list[Note] = []
        self._looked = time.monotonic()
        self._lock = Lock()

    def take(self, data: bytes) -> None:
        """Take a serialized JointState."""
        now = time.monotonic()
        with self._lock:
            for ready in self._input.feed(data):
                self._newest[ready.chain.name] = ready.positions, now

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Say in the page what moves the chains."""
        gui.add_markdown(f'live from `{self._topic}`')

    def advance(self) -> None:
        """Look once a second at what there is to say of the messages."""
        now = time.monotonic()
        if now < self._looked + _LOOK_PERIOD:
            return
        self._looked = now
        with self._lock:
            look = self._input.take_look()
        self._notes = notes_of(look, self._topic)
        if not look.messages:
            self._notes = [Note('no_message', f'no message on {self._topic}')]

    def postures(self) -> list[Posture]:
        """Return the joints of every chain as they came last."""
        with self._lock:
            newest = dict(self._newest)
        return [
            self._posture(chain, *newest.get(chain.name, (None, 0.0)))
            for chain in self._input.chains
        ]

    def trails(self) -> list[Array]:
        """Return no places: only the trails of a recording are drawn."""
        return [_NO_TRAIL] * len(self._input.chains)

    def _posture(self, chain: Chain, q: Sequence[float] | None, came: float) -> Posture:
        age = time.monotonic() - came
        if q is not None and age <= DEFAULT_TIMEOUT:
            return Posture(q)
        words = ['no pose yet' if q is None else f'no pose for {age:.1f} s']
        words += [note.text for note in self._notes if note.chain in ('', chain.name)]
        return Posture(q, '; '.join(words))


@contextmanager
def live_joints(chains: Sequence[Chain], topic: str) -> Iterator[LiveJoints]:
    """Follow the joint states of a topic while it lasts.

    Raises:
        MissingDependencyError: rclpy is not installed.
        LegFKError: ROS 2 cannot be started, or the topic has no such name.
    """
    rclpy, joint_state, _ = import_ros('view --live')
    joints = LiveJoints(chains, topic)
    context = rclpy.context.Context()
    quality = rclpy.qos.QoSProfile(
        depth=_DEPTH, reliability=rclpy.qos.QoSReliabilityPolicy.BEST_EFFORT
    )
    try:
        rclpy.init(
            args=[],
            context=context,
            signal_handler_options=rclpy.signals.SignalHandlerOptions.NO,
        )
        node = rclpy.create_node(
            'leg_fk_view',
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        node.create_subscription(joint_state, topic, joints.take, quality, raw=True)
    except rclpy.exceptions.InvalidTopicNameException as error:
        context.try_shutdown()
        reason = str(error).splitlines()[0].rstrip(':').partition(': ')[2]
        raise LegFKError(f'--joint-topic: found {topic!r}; {reason}') from error
    except (
        RuntimeError,
        ValueError,
    ) as error:  # what rclpy raises for what rcl refuses
        context.try_shutdown()
        raise LegFKError(
            f'ROS 2 cannot be started: {" ".join(str(error).split())}'
        ) from error
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(rclpy.executors.ExternalShutdownException):
            executor.spin()

    thread = Thread(target=spin)
    thread.start()
    try:
        yield joints
    finally:
        context.try_shutdown()
        thread.join()
        node.destroy_node()
