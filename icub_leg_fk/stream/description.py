"""The robot's description, a URDF, and what there is to say of it; free of rclpy.

Either it is what is computed with, or the tables are held against it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain, Urdf
from icub_leg_fk.kinematics.difference import distance, postures
from icub_leg_fk.stream.cdr import read_string
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.notes import ERROR, INFO, Note, WARNING

PARAMETER = 'description_from_topic'
UNUSABLE = 'unusable_description'

_POSTURES = 100
_NEAR_MM = 1.0
_NEAR_DEG = 0.1


class Comparison(NamedTuple):
    """A chain beside a description of the robot.

    Attributes:
        text: what was found, such as `l_sole is up to 0.45 mm and 0.00 deg off the robot's own`.
        is_far: whether the table is not that of the robot.
    """

    text: str
    is_far: bool = False


class Description:
    """The descriptions that come on a topic, one after the other.

    Args:
        topic: full name of the topic.
        use: what computes with a description from then on, and raises a LegFKError if it cannot;
            None if tables are computed with.
    """

    def __init__(self, topic: str, use: Callable[[Urdf], None] | None) -> None:
        self.topic = topic
        self._use = use
        self._urdf: Urdf | None = None
        self._fault = ''
        self._configuration: Configuration | None = None
        self._comparisons: dict[str, Comparison] = {}

    def take(self, data: bytes) -> None:
        """Take a serialized String in; if it cannot be used, what was good before stays."""
        try:
            urdf = Urdf.parse(read_string(data), self.topic)
            if self._use:
                self._use(urdf)
        except LegFKError as error:
            self._fault = str(error)
            return
        self._fault = ''
        self._urdf = urdf
        self._compare()

    def configure(self, configuration: Configuration) -> None:
        """Take in what is published."""
        self._configuration = configuration
        self._compare()

    def announcement(self) -> list[Note]:
        """Return what there is to say once of the last description and what is published."""
        if self._fault:
            return [self._fault_note()]
        notes = []
        if self._use and self._urdf:
            text = (
                f'computing with the description of {self._urdf.name} on {self.topic}'
            )
            notes.append(Note('description', text, level=INFO))
        for chain, (text, is_far) in self._comparisons.items():
            level = INFO
            if is_far:
                level = WARNING
                text += (
                    f'; {PARAMETER}:=true computes with the description on {self.topic}'
                )
            notes.append(Note('description', text, chain, level))
        return notes + self._notes_of_tf()

    def notes(self, publishers: Sequence[str]) -> list[Note]:
        """Return what is the matter for the time being, if it is computed with.

        Args:
            publishers: full names of the nodes that publish on the topic.
        """
        notes: list[Note] = []
        if not self._use:
            return notes
        count = f'{len(publishers) or "no"} publisher{"s" * (len(publishers) > 1)}'
        if self._fault:
            notes.append(self._fault_note())
        elif not self._urdf:
            text = (
                f'no description of the robot has come on {self.topic}; it has {count}'
            )
            notes.append(Note('no_description', text))
        if len(publishers) > 1:
            text = (
                f'{self.topic} has {count}, and the last description counts: '
                f'{", ".join(publishers)}'
            )
            notes.append(Note('descriptions', text))
        return notes

    def value(self, chain: str) -> str:
        """Return what diagnostics show of the description for a chain."""
        if chain in self._comparisons:
            return self._comparisons[chain].text
        return self._urdf.name if self._urdf else ''

    def _compare(self) -> None:
        """Hold the tables that are computed with against the description."""
        self._comparisons = {}
        if self._use or not self._urdf or not self._configuration:
            return
        for chain in self._configuration.chains:
            comparison = compared(chain, self._urdf, self._configuration.joint_prefix)
            self._comparisons[chain.name] = comparison

    def _fault_note(self) -> Note:
        if not self._use:
            return Note(UNUSABLE, f'not compared with the robot: {self._fault}')
        stays = 'nothing is published until another one comes'
        if self._urdf:
            stays = 'the one before stays'
        text = f'description of the robot not used: {self._fault}; {stays}'
        return Note(UNUSABLE, text, level=ERROR)

    def _notes_of_tf(self) -> list[Note]:
        """Warn of transforms that robot_state_publisher, which has the description, sends too."""
        configuration = self._configuration
        if not self._urdf or not configuration or not configuration.publish_tf:
            return []
        prefix = configuration.frame_prefix
        ids = [prefix + chain.frame_id for chain in configuration.chains]
        shared = [frame_id for frame_id in ids if frame_id in self._urdf.links]
        if not shared:
            return []
        text = (
            f'publish_tf sends {" and ".join(shared)}, which the description on '
            f'{self.topic} has, so that robot_state_publisher sends the same, fixed frames '
            'on /tf_static, and what comes on /tf displaces those: leave publish_tf off, or '
            'set a frame_prefix, which is not part of a description'
        )
        return [Note('shared_frames', text)]


def compared(chain: Chain, urdf: Urdf, joint_prefix: str = '') -> Comparison:
    """Return how far a chain's tip is at most from the robot's own, within its ranges.

    Compared is the first of the chain's tip frames that the description has, too.

    Args:
        chain: the chain.
        urdf: the description.
        joint_prefix: what is before the joint names of the chain, but not of the description.
    """
    root = chain.root_frame
    frames = [
        frame
        for frame, tip_frame in chain.tip_frames.items()
        if tip_frame.frame_id in urdf.links
    ]
    if root not in urdf.links:
        return _not_compared(f'no frame {root}', urdf)
    if not frames:
        tips = [tip_frame.frame_id for tip_frame in chain.tip_frames.values()]
        return _not_compared(f'no frame {" or ".join(tips)}', urdf)
    return _compared_at(chain.with_frame(frames[0]), urdf, joint_prefix)


def _compared_at(chain: Chain, urdf: Urdf, joint_prefix: str) -> Comparison:
    """Return how far a chain's present tip frame is from the link of that name."""
    root, tip = chain.root_frame, chain.frame_id
    try:
        path = urdf.path(root, tip)
    except LegFKError as error:
        return Comparison(f'not compared: {error}')
    moving = {joint.moved_by for joint in path if joint.moves}
    positions = postures(chain, _POSTURES)
    bare = {
        joint.removeprefix(joint_prefix): values for joint, values in positions.items()
    }
    if moving != bare.keys():
        joints = ', '.join(sorted(moving)) or 'none'
        return _not_compared(f'the joints from {root} to {tip} are {joints}', urdf)
    off = distance(chain.forward(positions), urdf.forward(root, tip, bare))
    is_far = off.mm > _NEAR_MM or off.deg > _NEAR_DEG
    return Comparison(
        f"{tip} is up to {off.mm:.2f} mm and {off.deg:.2f} deg off the robot's own",
        is_far,
    )


def _not_compared(reason: str, urdf: Urdf) -> Comparison:
    return Comparison(f'not compared: {reason} in {urdf.file}')
