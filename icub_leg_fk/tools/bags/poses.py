"""Adds foot poses to the messages of a bag, by the node's own rules and with its own code.

Each JointState goes through `JointStream`, as in the node, and every pose lands right behind the
message that gave it. Poses come from the node's own `Chain.pose` and `Chain.twist`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.configuration import Configuration
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_stream import JointStream, OnReady
from icub_leg_fk.ros.pose_cdr import PoseStampedEncoder
from icub_leg_fk.ros.twist_cdr import TwistStampedEncoder
from icub_leg_fk.tools.bags.cdr import TransformEncoder
from icub_leg_fk.tools.bags.topics import Message, new_topic, POSE, TF, Topic, TWIST

NODE = '/foot_pose_publisher'
TF_TOPIC = '/tf'

_Ready = tuple[int, int, int, int, Sequence[float], Sequence[float] | None]
"""Place in the block, time, sec and nanosec of the stamp, positions and velocities."""


def pose_topics(configuration: Configuration, like: Topic) -> list[Topic]:
    """Return the topics to add: poses, twists if asked for, and then TF if asked for.

    Args:
        configuration: chains and what is published of them.
        like: the bag's topic of joint states.
    """
    topics = []
    for chain in configuration.chains:
        topics.append(new_topic(f'{NODE}/{chain.tip}/pose', POSE, like))
        if configuration.publish_twist:
            topics.append(new_topic(f'{NODE}/{chain.tip}/twist', TWIST, like))
    if configuration.publish_tf:
        topics.append(new_topic(TF_TOPIC, TF, like))
    return topics


class PoseAdder:
    """Adds poses to blocks of messages.

    Args:
        configuration: chains and what is published of them.
        topics: all topics of the output, those of `pose_topics` among them.
        joint_topics: indices of the topics that bring joint states.
        keep: whether the messages themselves are kept; else there are only poses.

    Attributes:
        added: messages added, by index of their topic.
    """

    def __init__(self, configuration: Configuration, topics: Sequence[Topic],
                 joint_topics: Collection[int], keep: bool) -> None:
        self.added: Counter[int] = Counter()
        self._joint_topics = frozenset(joint_topics)
        self._keep = keep
        self._time = 0
        self._block: list[Any] = []
        self._input = JointInput(configuration.chains, configuration.joint_timeout)
        self._stream = JointStream(self._input, lambda: self._time, configuration.publish_twist)
        names = [topic.name for topic in topics]
        self._outputs = [_ChainOutput(chain, configuration, names)
                         for chain in configuration.chains]
        self._stream.on_ready = [self._collector(index, output, configuration.publish_twist)
                                 for index, output in enumerate(self._outputs)]

    def add(self, messages: Sequence[Message]) -> list[Message]:
        """Return a block of messages with its poses."""
        block = self._block = []
        joint_topics, keep, feed = self._joint_topics, self._keep, self._stream.feed
        for message in messages:
            if keep:
                block.append(message)
            if message[0] in joint_topics:
                self._time = message[2]
                feed(message[4])
        gaps = sum([output.fill(block, self.added) for output in self._outputs])
        return [message for message in block if message is not None] if gaps else block

    def settle(self) -> JointInput:
        """Return the rules' state, with all counts."""
        return self._stream.settle()

    def _collector(self, index: int, output: _ChainOutput, twist: bool) -> OnReady:
        places = (None,) * output.places
        ready = output.ready

        def collect(sec: int, nanosec: int, q: Sequence[float],
                    qdot: Sequence[float] | None) -> None:
            block = self._block
            ready.append((len(block), self._time, sec, nanosec, q, qdot))
            block.extend(places)
            if twist and qdot is None:
                self._stream.settle().note_no_velocity(index)
        return collect


class _ChainOutput:
    """What one chain's joint vectors become.

    Attributes:
        ready: joint vectors of this block.
        places: messages that one joint vector becomes, at most.
    """

    def __init__(self, chain: Chain, configuration: Configuration,
                 topics: Sequence[str]) -> None:
        root = configuration.frame_prefix + chain.root_frame
        tip = configuration.frame_prefix + chain.tip_frame
        self.ready: list[_Ready] = []
        self.places = 1 + configuration.publish_twist + configuration.publish_tf
        self._chain = chain
        self._pose_topic = topics.index(f'{NODE}/{chain.tip}/pose')
        self._encode_pose = PoseStampedEncoder(root).encode
        self._twist_topic = self._tf_topic = -1
        if configuration.publish_twist:
            self._twist_topic = topics.index(f'{NODE}/{chain.tip}/twist')
            self._encode_twist = TwistStampedEncoder(root).encode
        if configuration.publish_tf:
            self._tf_topic = topics.index(TF_TOPIC)
            self._encode_tf = TransformEncoder(root, tip).encode

    def fill(self, block: list[Message | None], added: Counter[int]) -> int:
        """Put the messages at their places and return how many twists there could not be."""
        if not self.ready:
            return 0
        ready = self.ready[:]
        self.ready.clear()
        poses = [self._chain.pose(item[4]) for item in ready]
        topic, encode = self._pose_topic, self._encode_pose
        added[topic] += len(ready)
        for (place, time, sec, nanosec, _, _), pose in zip(ready, poses):
            block[place] = (topic, 0, time, time, encode(sec, nanosec, pose))
        if self._tf_topic >= 0:
            added[self._tf_topic] += len(ready)
            for (place, time, sec, nanosec, _, _), pose in zip(ready, poses):
                block[place + self.places - 1] = (
                    self._tf_topic, 0, time, time, self._encode_tf(sec, nanosec, pose))
        if self._twist_topic < 0:
            return 0
        missing = self._fill_twists(ready, block)
        added[self._twist_topic] += len(ready) - missing
        return missing

    def _fill_twists(self, ready: Sequence[_Ready], block: list[Message | None]) -> int:
        moving = [item for item in ready if item[5] is not None]
        if moving:
            twists = [self._chain.twist(item[4], item[5] or ()) for item in moving]
            topic, encode = self._twist_topic, self._encode_twist
            for (place, time, sec, nanosec, _, _), twist in zip(moving, twists):
                block[place + 1] = (topic, 0, time, time, encode(sec, nanosec, twist))
        return len(ready) - len(moving)
