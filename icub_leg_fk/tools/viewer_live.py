"""A running robot in the viewer: what comes over ROS 2, its joint states and its description."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Lock, Thread
import time
from typing import Any

from icub_leg_fk.errors import LegFKError, ParameterError
from icub_leg_fk.kinematics import Chain, Urdf
from icub_leg_fk.stream.cdr import read_string
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.stream.notes import Note, notes_of
from icub_leg_fk.tools.ros import running_ros
from icub_leg_fk.tools.viewer_page import Numbers
from icub_leg_fk.tools.viewer_source import (
    Changed,
    Posture,
    posture_at,
    TRAIL,
    TRAIL_POINTS,
)
import numpy as np

_DEFAULT_TOPIC = 'joint_states'
_DEPTH = 100
_LOOK_PERIOD = 1.0  # s
_INTERVAL = TRAIL / TRAIL_POINTS  # s; a trail has no samples nearer to each other

Select = Callable[[Urdf], Sequence[Chain]]
Samples = deque[tuple[float, Sequence[float]]]  # when they came [s], joint positions


class LiveRobot:
    """Moves the chains as joint states say, by the node's own rules.

    Args:
        chains: the chains.
        topics: topics of the joint states; `joint_states` if none is named.
        select: what makes the chains of a description of the robot, which then take the place of
            those; None if no description is to be followed.
        description_topic: topic of the description; if empty `robot_description` in the namespace
            of the first topic of joint states.

    Attributes:
        topics: topics of the joint states.
        description_topic: topic of the description.
        follows_description: whether a description is followed.
    """

    is_moving = True

    def __init__(
        self,
        chains: Sequence[Chain],
        topics: Sequence[str] = (),
        select: Select | None = None,
        description_topic: str = '',
    ) -> None:
        self.topics = tuple(topics) or (_DEFAULT_TOPIC,)
        namespace, slash, _ = self.topics[0].rpartition('/')
        beside = f'{namespace}{slash}robot_description'
        self.description_topic = description_topic or beside
        self._topic = ' and '.join(self.topics)
        self.follows_description = select is not None
        self._select = select
        self._description: bytes | None = None
        self._about: list[str] = []
        if select:
            self._about = [
                'the tables, until a description',
                f'on {self.description_topic}',
            ]
        self._fault = ''
        self._lock = Lock()
        self._input = JointInput(time.time_ns)
        self._notes: list[Note] = []
        self._looked = time.monotonic()
        self._show(chains)

    def take(self, data: bytes) -> None:
        """Take a serialized JointState."""
        now = time.monotonic()
        with self._lock:
            for ready in self._input.feed(data):
                samples = self._samples[ready.chain.name]
                if len(samples) > 1 and now - samples[-2][0] < _INTERVAL:
                    samples.pop()
                samples.append((now, ready.positions))

    def take_description(self, data: bytes) -> None:
        """Take a serialized String, which is a description of the robot."""
        with self._lock:
            self._description = data

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Say in the page what moves the chains, and what they are."""
        self._words = Numbers(gui)
        self._say()

    def step(self) -> list[Posture]:
        """Take in what has come, and return the joints of every chain as they came last."""
        with self._lock:
            data, self._description = self._description, None
        if data is not None:
            self._use(data)
        with self._lock:
            samples = {name: list(taken) for name, taken in self._samples.items()}
        now = time.monotonic()
        if now > self._looked + _LOOK_PERIOD:
            self._looked = now
            self._look()
        postures = []
        for chain in self.chains:
            times = np.array([came for came, _ in samples[chain.name]])
            positions = np.array([q for _, q in samples[chain.name]])
            posture = posture_at(now, chain, times, positions)
            postures.append(self._noted(chain.name, posture))
        return postures

    def _show(self, chains: Sequence[Chain]) -> None:
        self.chains = tuple(chains)
        with self._lock:
            self._input.configure(chains, DEFAULT_TIMEOUT)
            self._samples: dict[str, Samples] = {
                chain.name: deque(maxlen=TRAIL_POINTS) for chain in chains
            }

    def _use(self, data: bytes) -> None:
        """Show the chains of a description; if it cannot be used, what was shown stays."""
        assert self._select
        try:
            urdf = Urdf.parse(read_string(data), self.description_topic)
            chains = tuple(self._select(urdf))
        except LegFKError as error:
            fault = error.fault if isinstance(error, ParameterError) else error
            self._fault = f'description of the robot not used: {fault}'
        else:
            self._about = [f'the description of {urdf.name}', f'on {urdf.file}']
            self._fault = ''
            if chains != self.chains:
                self._show(chains)
        self._say()

    def _say(self) -> None:
        self._words.show({f'live from {self._topic}': self._about}, self._fault)

    def _look(self) -> None:
        """Look at what there is to say of the messages."""
        with self._lock:
            look = self._input.take_look()
        self._notes = notes_of(look, self._topic)
        if not look.messages:
            self._notes = [Note('no_message', f'no message on {self._topic}')]

    def _noted(self, chain: str, posture: Posture) -> Posture:
        """Return a posture with the reasons why there is none, or no newer one."""
        if not posture.note:
            return posture
        texts = [note.text for note in self._notes if note.chain in ('', chain)]
        return posture._replace(note='; '.join([posture.note, *texts]))


@contextmanager
def following(robot: LiveRobot) -> Iterator[LiveRobot]:
    """Let a robot take what comes over ROS 2 while it lasts.

    Raises:
        MissingDependencyError: rclpy is not installed.
        LegFKError: ROS 2 cannot be started, or a topic has no such name.
    """
    with running_ros('view --live', 'leg_fk_view') as ros:
        qos = ros.rclpy.qos
        best_effort = qos.QoSProfile(
            depth=_DEPTH, reliability=qos.QoSReliabilityPolicy.BEST_EFFORT
        )
        last_one = qos.QoSProfile(
            depth=1, durability=qos.QoSDurabilityPolicy.TRANSIENT_LOCAL
        )
        for topic in robot.topics:
            try:
                ros.node.create_subscription(
                    ros.joint_state, topic, robot.take, best_effort, raw=True
                )
            except ros.rclpy.exceptions.InvalidTopicNameException as error:
                reason = str(error).splitlines()[0].rstrip(':').partition(': ')[2]
                raise LegFKError(f'--joint-topic: found {topic!r}; {reason}') from error
        if robot.follows_description:
            ros.node.create_subscription(
                ros.string,
                robot.description_topic,
                robot.take_description,
                last_one,
                raw=True,
            )
        thread = Thread(target=ros.executor.spin)
        thread.start()
        try:
            yield robot
        finally:
            ros.executor.shutdown()
            thread.join()
