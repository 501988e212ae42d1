"""Arbitrary message sequences through the joint input, against a naive model of its rules."""

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    initialize,
    precondition,
    rule,
    RuleBasedStateMachine,
    run_state_machine_as_test,
)
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.ros import joint_stream
from joint_model import CATALOG, Message
from joint_trial import SECOND, SPECIAL, Traffic, Trial
import pytest

MESSAGES = 120_000
SEQUENCE = 1000
TIMEOUTS = (0, 1, 1_000_000, SECOND // 2, 30 * SECOND)  # ns


@pytest.fixture(scope='module')
def robots(tmp_path_factory):
    """Return chains that share joints, and the iCub's own."""
    file = tmp_path_factory.mktemp('catalog') / 'kinematics.yaml'
    file.write_text(CATALOG)
    robot, icub = Catalog.load(file), Catalog.load()
    arm, camera, pointer = (robot.chain(name, 'a') for name in ('arm', 'camera', 'pointer'))
    return ((arm, camera, pointer), (pointer,), (camera, arm),
            tuple(icub.chain(name, 'v2_5') for name in ('left_leg', 'right_leg')),
            (icub.chain('left_leg', 'v1'), icub.chain('head_imu', 'v2')))


def test_any_sequence_gives_the_poses_that_the_rules_give(robots, monkeypatch):
    sent = ready = decoded = 0

    def counting_decode(data):
        nonlocal decoded
        decoded += 1
        return decode(data)

    decode = joint_stream.decode_joint_state
    monkeypatch.setattr(joint_stream, 'decode_joint_state', counting_decode)

    @settings(max_examples=MESSAGES // SEQUENCE, deadline=None, database=None)
    @given(seed=st.integers(0, 2**64 - 1))
    def run(seed):
        nonlocal sent, ready
        rng = random.Random(seed)
        chains = rng.choice(robots)
        trial, traffic = Trial(chains, rng.choice(TIMEOUTS)), Traffic(rng, chains)
        malformed, checked = rng.choice((0.0, 0.01)), rng.choice((0.002, 0.02, 1.0))
        for _ in range(SEQUENCE):
            message = traffic.next_message()
            if rng.random() < malformed:
                trial.send_malformed(message.cdr()[:rng.randrange(12)])
                sent += 1
                continue
            trial.now += rng.randrange(20_000_000)
            ready += len(trial.send(message))
            sent += 1
            if rng.random() < checked:
                trial.check_state()
        trial.check_state()

    run()
    assert sent >= 100_000
    assert ready > sent / 4, 'the traffic hardly makes poses'
    # Each of two streams decodes the messages that it does not take the fast way.
    assert 0.2 < (2 * sent - decoded) / (2 * sent) < 0.8, 'only one of the two ways is tried'


JOINTS = ('turn', 'lift', 'reach', 'tilt')
NAMES = st.one_of(
    st.permutations(JOINTS), st.sampled_from([('lift',), ('tilt', 'turn'), JOINTS[:3], ()]),
    st.lists(st.sampled_from((*JOINTS, '', 'wheel')), max_size=7))
NUMBERS = st.one_of(st.sampled_from((0.1, 0.2)), st.sampled_from(SPECIAL), st.floats())


class JointInputMachine(RuleBasedStateMachine):
    """Shorter sequences, which hypothesis can shrink."""

    chains = ()

    @initialize(timeout=st.sampled_from(TIMEOUTS))
    def begin(self, timeout):
        self.trial = Trial(self.chains, timeout)
        self.stamp = 0
        self.last = None

    @rule(names=NAMES, longer=st.sampled_from((0, 0, 0, -1, 2)), data=st.data(),
          step=st.sampled_from((0, 1, SECOND // 2, SECOND // 2 + 1, 40 * SECOND, -1, -SECOND)))
    def send(self, names, longer, step, data):
        numbers = st.lists(NUMBERS, min_size=max(len(names) + longer, 0),
                           max_size=max(len(names) + longer, 0)).map(tuple)
        self.stamp = max(self.stamp + step, -2**31 * SECOND)
        sec, nanosec = divmod(self.stamp, SECOND)
        self.last = Message(sec, nanosec, tuple(names), data.draw(numbers),
                            data.draw(st.one_of(numbers, st.just(()))))
        self.trial.send(self.last)

    @precondition(lambda self: self.last is not None)
    @rule(step=st.sampled_from((0, 1, SECOND)), number=NUMBERS)
    def send_the_like(self, step, number):
        self.stamp += step
        sec, nanosec = divmod(self.stamp, SECOND)
        positions = (number, *self.last.positions[1:]) if self.last.positions else ()
        self.trial.send(Message(sec, nanosec, self.last.names, positions, self.last.velocities))

    @rule()
    def look(self):
        self.trial.check_state()

    def teardown(self):
        self.trial.check_state()


def test_short_sequences_follow_the_rules_too(robots):
    machine = type('Machine', (JointInputMachine,), {'chains': robots[0]})
    run_state_machine_as_test(machine, settings=settings(
        max_examples=100, stateful_step_count=40, deadline=None, database=None))
