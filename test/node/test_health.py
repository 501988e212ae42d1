"""Health in memory: each thing is said once, and again only after it has been well in between."""

from icub_leg_fk.node.health import (
    HealthLog,
    notes_around,
    Surroundings,
    Totals,
    verdict,
)
from icub_leg_fk.stream.notes import notes_of
import pytest
from support.leg_input import BOTH, LEFT, LegInput, RIGHT
from support.node_harness import ERROR, OK, STALE, WARN


class Logger:
    """What logs, throttled within five looks as rclpy does within five seconds."""

    def __init__(self, said):
        self.said = said
        self.quiet_until = 0

    def get_child(self, name):
        return Logger(self.said)

    def info(self, text):
        self.said.append(f'info: {text}')

    def warning(self, text, throttle_duration_sec=0.0):
        looks = self.said.looks
        if looks >= self.quiet_until:
            self.quiet_until = looks + throttle_duration_sec
            self.said.append(text)


class Said(list):
    looks = 0


class Watch:
    """A node's health without the node."""

    def __init__(self):
        self.input = LegInput(velocities=False)
        self.said = Said()
        self.log = HealthLog(Logger(self.said))
        self.totals = Totals()
        self.ms = 0
        self.around = Surroundings(
            '/joint_states', ['/bridge'], [], 0.0, True, '/node', ['/node']
        )

    def looks(self, n=1, names=BOTH, positions=None, **around):
        """Let n looks pass, in each of which two like messages come; return what was said."""
        before = len(self.said)
        for _ in range(n):
            for _ in range(2 if names else 0):
                self.ms += 10
                self.input.send(self.ms, names, positions)
            self.look(**around)
        return self.said[before:]

    def look(self, **around):
        look = self.input.take_look()
        self.said.looks += 1
        surroundings = self.around._replace(**around)
        notes = [
            *notes_around(look, surroundings, self.totals),
            *notes_of(look, '/joint_states'),
        ]
        self.log.show(notes, look)
        self.totals.add(look)
        self.verdicts = [verdict(look, chain, notes) for chain in look.chains]


@pytest.fixture
def watch():
    """Return the health of a node that has said its first poses."""
    watch = Watch()
    assert watch.looks() == [
        'info: first pose of left_foot; 1 publisher on /joint_states',
        'info: first pose of right_foot; 1 publisher on /joint_states',
    ]
    assert watch.looks(20) == []
    assert watch.verdicts == [(OK, 'publishing')] * 2
    return watch


WANTED = ', '.join(LEFT)
DEGREES = [0.0, 0.0, 0.0, -45.0] + [0.0] * 8
LASTING = {
    'names that never match': (
        f'left_leg: no message on /joint_states has one of its joints ({WANTED}); names '
        f'that came: {", ".join(RIGHT)}',
        5,
        {'names': RIGHT},
    ),
    'positions that are always empty': (
        'no message on /joint_states has positions: position is empty',
        5,
        {'positions': []},
    ),
    'degrees': (
        'left_leg: positions look like degrees, radians are expected: l_knee -45',
        1,
        {'positions': DEGREES},
    ),
    'simulated time that has not begun': (
        'use_sim_time is set, but no time has come on /clock',
        5,
        {'has_time': False},
    ),
    'another node of the same name': (
        'another node is called /node and publishes the same topics; give one of them '
        'another name: --ros-args -r __node:=NAME',
        5,
        {'pose_publishers': ['/node', '/other', '/node']},
    ),
}


@pytest.mark.parametrize('reason', LASTING)
def test_what_lasts_is_said_once_and_again_only_after_it_was_well(watch, reason):
    line, patience, bad = LASTING[reason]
    for _ in range(2):
        assert watch.looks(patience - 1, **bad) == []
        assert watch.looks(1, **bad) == [line]
        assert watch.looks(9, **bad) == []
        level, message = watch.verdicts[0]
        assert level in (WARN, ERROR)
        assert message.startswith(line.removeprefix('left_leg: '))
        assert watch.looks(1) == []


def test_silence_with_what_was_before_and_who_is_there(watch):
    for n in (42, 44):
        assert watch.looks(4, names=(), silence=4.2, publishers=[]) == []
        line = (
            f'no JointState received on /joint_states for 5 s, {n} before; it has no '
            'publisher'
        )
        assert watch.looks(3, names=(), silence=5.2, publishers=[]) == [line]
        assert watch.verdicts == [(STALE, line)] * 2
        assert watch.looks() == []


def test_names_that_match_now_and_then(watch):
    for _ in range(5):
        assert watch.looks(3, names=RIGHT) + watch.looks(2) == []


def test_silence_in_between_is_not_well(watch):
    assert watch.looks(4, names=RIGHT) + watch.looks(3, names=()) == []
    assert len(watch.looks(1, names=RIGHT)) == 1
    assert watch.looks(1, names=()) + watch.looks(9, names=RIGHT) == []


def test_out_of_range_is_for_diagnostics_alone(watch):
    assert watch.looks(9, positions=[0.0] * 5 + [0.6] + [0.0] * 6) == []
    assert watch.verdicts == [
        (WARN, 'out of range: l_ankle_roll 0.6'),
        (OK, 'publishing'),
    ]


def test_rejected_messages_are_said_every_five_seconds(watch):
    line = '2 messages rejected: position has 11 values for 12 names'
    assert watch.looks(12, positions=[0.0] * 11) == [line] * 3
    assert watch.verdicts == [(ERROR, line)] * 2


def test_what_holds_chains_back_is_said_every_five_seconds(watch):
    positions = [float('nan'), *[0.0] * 10, float('inf')]
    assert (
        watch.looks(6, positions=positions)
        == [
            'left_leg: no pose from 2 messages: l_hip_pitch nan; '
            'right_leg: no pose from 2 messages: r_ankle_roll inf'
        ]
        * 2
    )
    assert watch.verdicts[0] == (ERROR, 'no pose from 2 messages: l_hip_pitch nan')


def test_a_chain_whose_joints_come_without_positions_gives_no_pose(watch):
    watch.input.send(watch.ms, LEFT, [])
    watch.looks(1, names=RIGHT)
    assert watch.verdicts == [
        (ERROR, 'no message with a position of its joints'),
        (OK, 'publishing'),
    ]


def test_every_loop_of_a_bag_is_said(watch):
    for _ in range(3):
        for ms in range(1000, 1200, 10):
            watch.input.send(ms)
        watch.look()
    assert (
        watch.said[2:]
        == ['time stepped back to 1700000001.000 s; held joints are forgotten'] * 2
    )


def test_publishers_that_seem_to_bring_the_same_joints(watch):
    two = ['/bridge', '/ns/sim']
    assert watch.looks(9, publishers=two) == [
        'info: 2 publishers on /joint_states',
        'left_leg: every message on /joint_states brings its joints, and it has 2 publishers: '
        '/bridge, /ns/sim',
        'right_leg: every message on /joint_states brings its joints, and it has 2 publishers: '
        '/bridge, /ns/sim',
    ]
    assert [level for level, _ in watch.verdicts] == [WARN, WARN]


def test_publishers_of_different_joints(watch):
    for _ in range(9):
        watch.input.send(watch.ms, LEFT)
        watch.looks(names=RIGHT, publishers=['/left', '/right'])
    assert watch.said[2:] == ['info: 2 publishers on /joint_states']
