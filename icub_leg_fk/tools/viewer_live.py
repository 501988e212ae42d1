"""A running robot in the viewer: the joint states that come over ROS 2."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock, Thread
import time
from types import TracebackType
from typing import Any

from icub_leg_fk.errors import LegFKError, MissingDependencyError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.tools.viewer_page import Changed, Posture
import numpy as np

DEFAULT_TOPIC = 'joint_states'
_DEPTH = 100
_NO_TRAIL = np.zeros((0, 3))


class LiveJoints:
    """Moves the chains as joint states say, by the node's own rules, until it is left.

    Args:
        chains: the chains.
        topic: topic of the joint states.
    """

    is_moving = True

    def __init__(self, chains: Sequence[Chain], topic: str) -> None:
        self._input = JointInput(chains, DEFAULT_TIMEOUT, time.time_ns)
        self._newest: dict[int, tuple[Sequence[float], float]] = {}  # q, and when it came [s]
        self._lock = Lock()
        self._topic = topic
        self._start()

    def _start(self) -> None:
        """Subscribe, and take messages in a thread of its own."""
        try:
            import rclpy
            from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
            from rclpy.qos import QoSProfile, QoSReliabilityPolicy
            from rclpy.signals import SignalHandlerOptions
            from sensor_msgs.msg import JointState
        except ImportError as error:
            raise MissingDependencyError('rclpy', 'view --live', 'source ROS 2, or pip install '
                                         'icub_leg_fk[ros]') from error
        self._context = rclpy.Context()
        best_effort = QoSProfile(depth=_DEPTH, reliability=QoSReliabilityPolicy.BEST_EFFORT)
        try:
            rclpy.init(args=[], context=self._context,
                       signal_handler_options=SignalHandlerOptions.NO)
            self._node = rclpy.create_node(
                'leg_fk_view', context=self._context, use_global_arguments=False,
                enable_rosout=False, start_parameter_services=False)
            self._node.create_subscription(JointState, self._topic, self._take, best_effort,
                                           raw=True)
        except (RuntimeError, ValueError) as error:  # what rclpy raises for what rcl refuses
            self._context.try_shutdown()
            raise LegFKError(f'--live: {" ".join(str(error).split())}') from error
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(self._node)

        def spin() -> None:
            try:
                executor.spin()
            except ExternalShutdownException:
                pass

        self._thread = Thread(target=spin, daemon=True)
        self._thread.start()

    def __enter__(self) -> LiveJoints:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self._context.try_shutdown()
        self._thread.join()
        self._node.destroy_node()

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Say in the page what moves the chains."""
        gui.add_markdown(f'live: `{self._topic}`')

    def advance(self) -> None:
        """Do nothing: messages are taken as they come."""

    def postures(self) -> list[Posture]:
        """Return the joints of every chain as they came last."""
        with self._lock:
            newest = dict(self._newest)
        return [self._posture(chain, newest) for chain in range(len(self._input.chains))]

    def trails(self) -> list[Array]:
        """Return no places: only a recording's trails are drawn."""
        return [_NO_TRAIL] * len(self._input.chains)

    def _posture(self, chain: int, newest: dict[int, tuple[Sequence[float], float]]) -> Posture:
        if chain not in newest:
            return Posture(None, f'no pose yet from {self._topic}')
        q, came = newest[chain]
        age = time.monotonic() - came
        return Posture(q, f'no pose for {age:.1f} s' if age > DEFAULT_TIMEOUT else '')

    def _take(self, data: bytes) -> None:
        """Take a serialized JointState."""
        now = time.monotonic()
        with self._lock:
            for ready in self._input.feed(data):
                self._newest[ready.chain] = ready.positions, now
