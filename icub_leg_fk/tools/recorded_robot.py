"""The robot of a recording: chains of tables, or of the descriptions that the recording has."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
import math
from typing import Any, NamedTuple

from icub_leg_fk.errors import InputFileError, LegFKError, ParameterError
from icub_leg_fk.kinematics import Catalog, Chain, Urdf
from icub_leg_fk.stream.cdr import read_string
from icub_leg_fk.stream.configuration import Configuration, LEGS
from icub_leg_fk.stream.description import compared, PARAMETER
from icub_leg_fk.stream.joint_input import JointInput, Look, Ready
from icub_leg_fk.tools import options
from icub_leg_fk.tools.bags import Bag, namespace_of, STRING
from icub_leg_fk.tools.joint_states import SECOND

OPTION = '--description-from-topic'

_TOPIC = 'robot_description'


class Period(NamedTuple):
    """A time from which on a robot has some chains.

    Attributes:
        start: when it begins [ns].
        chains: the chains.
    """

    start: float
    chains: Sequence[Chain]


@dataclass(frozen=True)
class Described:
    """Chains of a robot that is described in the recording itself.

    Attributes:
        topic: topic of the descriptions; if True `robot_description` in the namespace of the
            joint states.
        root: the link that poses are given in; `root_link` or else the top if None.
        settings: what `Configuration.checked` takes.

    Raises:
        ParameterError: a setting cannot be used with any description.
    """

    topic: bool | str
    root: str | None
    settings: Mapping[str, Any]

    def __post_init__(self) -> None:
        Configuration.checked(None, **self.settings)


@dataclass
class Robot:
    """A robot, whose chains may change.

    Attributes:
        periods: its chains, the later ones last.
        warnings: what is doubtful, one line each.
        notes: what else a user should know, one line each.
    """

    periods: list[Period] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def chains(self) -> list[Chain]:
        """Return the chains of all periods."""
        return [chain for period in self.periods for chain in period.chains]


class RobotInput:
    """Takes JointStates in, by the node's rules, for the chains that a robot has at the time.

    Args:
        robot: the robot.
        joint_timeout: how far a joint may lag the newest of its chain [s]; 0 is any time.
        velocities: whether velocities are wanted.
        begin: called with the chains of each period when it begins.
    """

    def __init__(
        self,
        robot: Robot,
        joint_timeout: float,
        velocities: bool,
        begin: Callable[[Sequence[Chain]], None] = lambda chains: None,
    ) -> None:
        self._now = 0
        self._joint_input = JointInput(lambda: self._now)
        self._periods = robot.periods[::-1]
        self._settings = joint_timeout, velocities
        self._begin = begin
        self._begin_next()

    def feed(self, now: int, data: bytes) -> list[Ready]:
        """Take a JointState in that was recorded at a time [ns]; return what it makes ready."""
        while now >= self._next:
            self._begin_next()
        self._now = now
        return self._joint_input.feed(data)

    def take_look(self) -> Look:
        """Return what has happened."""
        return self._joint_input.take_look()

    def _begin_next(self) -> None:
        chains = self._periods.pop().chains
        self._joint_input.configure(chains, *self._settings)
        self._begin(chains)
        self._next = self._periods[-1].start if self._periods else math.inf


def refuse_second_source(kinematics_file: str | None) -> None:
    """Refuse a kinematics file beside the descriptions of a recording."""
    if kinematics_file is not None:
        raise ParameterError(
            PARAMETER,
            f'goes without a kinematics file, and there is {kinematics_file!r}',
        )


def recorded_chains(args: argparse.Namespace) -> Sequence[Chain] | Described:
    """Return the chains asked for, or how those of a recording's description are chosen."""
    if not args.description_from_topic:
        return options.chains_of_one_root(args)
    refuse_second_source(args.kinematics_file)
    settings = options.settings_of(args, args.chains or LEGS)
    return Described(args.description_from_topic, args.root, settings)


def robot_of(
    chains: Sequence[Chain] | Described,
    bags: Sequence[Bag],
    joint_topics: Sequence[str],
    joint_prefix: str,
) -> Robot:
    """Return the robot of a recording.

    Args:
        chains: chains of tables, which are held against a description if there is one; or of the
            descriptions.
        bags: the bags of the recording.
        joint_topics: topics of joint states in them, as they were asked for.
        joint_prefix: what is before the joint names of chains of tables.

    Raises:
        InputFileError: there is no description that can be used; says why.
    """
    if not isinstance(chains, Described):
        joints = [name for chain in chains for name in chain.joint_names]
        topics = [_topic_of(bag, joint_topics, joints) for bag in bags]
        return _compared(chains, _sent(bags, topics, most=1)[:1], joint_prefix)
    if isinstance(chains.topic, str):
        topics = [chains.topic] * len(bags)
    else:
        topics = [_topic_of(bag, joint_topics) for bag in bags]
    return _described(chains, bags, topics)


class _Sent(NamedTuple):
    """A description as it was recorded: time [ns], topic, and CDR bytes."""

    time: int
    topic: str
    data: bytes


def _topic_of(bag: Bag, joint_topics: Sequence[str], joints: Sequence[str] = ()) -> str:
    """Return the topic of descriptions in the namespace of a bag's joint states."""
    connections = bag.joint_connections(joint_topics, joints)
    return f'{namespace_of(each.topic for each in connections)}/{_TOPIC}'


def _sent(
    bags: Sequence[Bag], topics: Sequence[str], most: int | None = None
) -> list[_Sent]:
    """Return the first descriptions on a topic of each bag, in the order of their times."""
    sent = []
    for bag, topic in zip(bags, topics, strict=True):
        messages = bag.messages(bag.connections_of(STRING, [topic]))
        sent += [_Sent(time, topic, data) for _, time, data in islice(messages, most)]
    return sorted(sent)


def _described(wanted: Described, bags: Sequence[Bag], topics: Sequence[str]) -> Robot:
    """Return the robot of the descriptions on a topic of each bag."""
    sent = _sent(bags, topics)
    name = ', '.join(str(bag.path) for bag in bags)
    if not sent:
        others = {topic for bag in bags for topic in bag.topics(STRING)}
        raise InputFileError(
            name,
            f'no description of the robot on {" or ".join(dict.fromkeys(topics))}; topics of '
            f'type {STRING}: {", ".join(sorted(others)) or "none"}',
        )
    robot = _periods(wanted, sent, min(bag.span[0] for bag in bags))
    if not robot.periods:
        raise InputFileError(name, robot.warnings[0])
    return robot


def _periods(wanted: Described, sent: Sequence[_Sent], start: int) -> Robot:
    """Return what some descriptions describe; the first usable one counts from the beginning."""
    robot = Robot()
    before = b''
    for time, topic, data in sent:
        if data == before:
            continue
        before = data
        after = f'{(time - start) / SECOND:.3f} s after the start'
        try:
            urdf = Urdf.parse(read_string(data), topic)
            catalog = Catalog.from_urdf(urdf, root=wanted.root)
            configuration = Configuration.checked(catalog, **wanted.settings)
            _refuse_other_places(configuration.chains, robot.periods)
        except LegFKError as error:
            fault = error.fault if isinstance(error, ParameterError) else str(error)
            stays = '; the one before stays' if robot.periods else ''
            robot.warnings.append(
                f'description of the robot {after} not used: {fault}{stays}'
            )
            continue
        robot.warnings += configuration.warnings
        since = f'from {after} on ' if robot.periods else ''
        robot.notes.append(
            f'{since}computing with the description of {urdf.name} on {topic}'
        )
        robot.notes += [line for line in configuration.notes if line not in robot.notes]
        first = time if robot.periods else -math.inf
        robot.periods.append(Period(first, configuration.chains))
    return robot


def _refuse_other_places(chains: Sequence[Chain], periods: Sequence[Period]) -> None:
    """Refuse chains whose poses have other names, or other roots, than those before."""
    before = periods[0].chains if periods else chains
    for chain, old in zip(chains, before, strict=True):
        if (chain.root_frame, chain.tip) != (old.root_frame, old.tip):
            raise LegFKError(
                f'{chain.name} goes from {chain.root_frame} to {chain.tip}, and in the one '
                f'before from {old.root_frame} to {old.tip}'
            )


def _compared(
    chains: Sequence[Chain], sent: Sequence[_Sent], joint_prefix: str
) -> Robot:
    """Return the robot of some tables, with how far they are from a description."""
    robot = Robot([Period(-math.inf, chains)])
    for _, topic, data in sent:
        try:
            urdf = Urdf.parse(read_string(data), topic)
        except LegFKError as error:
            robot.notes.append(f'not compared with the robot: {error}')
            continue
        for chain in chains:
            text, is_far = compared(chain, urdf, joint_prefix)
            if is_far:
                way = f'{OPTION} computes with the description on {topic}'
                robot.warnings.append(f'{chain.name}: {text}; {way}')
            else:
                robot.notes.append(f'{chain.name}: {text}')
    return robot
