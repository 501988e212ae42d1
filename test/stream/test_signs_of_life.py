"""Signs of life: each is said once, and again only after it has been well in between."""

from collections import Counter

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.node.signs_of_life import JOINT_STATE, Second, SignsOfLife, ThrottledWarnings
from icub_leg_fk.stream.joint_input import ChainCounts, JointInput
import pytest
from support.joint_model import Message

LEG = Catalog.load().chain('left_leg', 'v2_5')
KNEE = LEG.joint_names[3]


class Node:
    """Signs of life with the seconds they look at and what they log."""

    def __init__(self):
        self.said = []
        self.signs = SignsOfLife(self, '/joint_states')
        self.messages = 0

    def info(self, text):
        self.said.append(f'info: {text}')

    def warning(self, text):
        self.said.append(f'warning: {text}')

    def seconds(self, n=1, messages=50, names=LEG.joint_names, ready=50, silence=0.0,
                types=(JOINT_STATE,), joints=None, **rejected):
        """Let some seconds pass, all alike, and return what was said of them."""
        before = len(self.said)
        for _ in range(n):
            self.signs.look(Second(
                messages, self.messages, silence, Counter(rejected),
                [(LEG, ChainCounts(ready=ready, joints=joints or {}))], names, types))
            self.messages += messages
        return self.said[before:]


@pytest.fixture
def node():
    """Return a node that has said its first pose."""
    node = Node()
    assert node.seconds() == ['info: first pose of left_foot; 1 publisher on /joint_states']
    assert node.seconds(100) == []
    return node


def twice(node, text, **bad):
    """Check that something bad is said, again after it was well, and not in between."""
    for _ in range(2):
        assert node.seconds(**bad) + node.seconds(9, **bad) == [text]
        assert node.seconds(9) == []


def after_five_seconds(node, text, **bad):
    """Check the same of something that may last four seconds."""
    assert node.seconds(4, **bad) == []
    assert node.seconds(**bad) == [text]
    assert node.seconds(20, **bad) + node.seconds() + node.seconds(4, **bad) == []
    assert node.seconds(**bad) == [text]


def test_silence_says_what_was_before_and_who_is_there(node):
    assert node.seconds(silence=4.9, messages=0, ready=0, types=()) == []
    for n in (101, 102):
        [text] = node.seconds(3, silence=5.1, messages=0, ready=0, types=())
        assert text == (f'warning: no JointState on /joint_states for 5 s, {50 * n} before; '
                        'no publisher there')
        node.seconds()


def test_silence_before_the_first_message_names_a_wrong_type():
    node = Node()
    assert node.seconds(9, silence=6.2, messages=0, ready=0, types=['std_msgs/msg/String']) == [
        'warning: no JointState on /joint_states for 6 s; no publisher, but one of type '
        'std_msgs/msg/String there']


@pytest.mark.parametrize(('name', 'near'), [
    ('L_KNEE', True), ('icub/l_knee', True), ('icub::l_knee', True), ('l_knee_joint', True),
    ('ICUB_L_KNEE', True), ('r_knee', False), ('special_knee', False), ('l_kneecap', False)])
def test_names_that_never_match_are_told_with_those_that_are_near(node, name, near):
    hint = f"; '{name}' is nearly 'l_knee', but names must be equal" if near else ''
    after_five_seconds(
        node, 'warning: no message on /joint_states has a joint of left_leg '
        f'({", ".join(LEG.joint_names)}); names that came: wheel, {name}{hint}',
        names=('wheel', name), ready=0)


def test_many_long_names_fit_a_line(node):
    [text] = node.seconds(5, names=['x' * 9999] * 4999 + ['x/' * 9999 + KNEE], ready=0)
    assert len(text) < 1000
    assert text.endswith('x and 4988 more')


def test_a_joint_that_comes_now_and_then_or_is_held_back_is_no_foreign_name(node):
    for _ in range(9):
        assert node.seconds(3, names=['wheel'], ready=0) == []
        assert node.seconds(2, names=['wheel', KNEE], ready=0) == []
    assert node.seconds(9, names=[], ready=0, messages=50, malformed=50) == []


def test_positions_that_are_always_empty_are_told(node):
    after_five_seconds(
        node, 'warning: no message on /joint_states has positions: position is empty',
        ready=0, empty_position=50)


def test_several_publishers_are_told_once_and_warned_about_if_their_stamps_step_back(node):
    two = [JOINT_STATE] * 2
    assert node.seconds(9, types=two) == ['info: 2 publishers on /joint_states']
    twice(node, 'warning: 2 publishers on /joint_states, and their stamps step back: do they '
          'bring the same joints?', types=two, time_jump=3)
    assert node.seconds(9, time_jump=1) == []  # a bag that loops


def test_degrees_are_told_until_the_robot_moves_within_its_range(node):
    twice(node, 'warning: left_leg: positions look like degrees, radians are expected: '
          'l_knee -45', joints={'looks_like_degrees': {KNEE: '-45'}})


def test_degrees_are_told_by_the_joint_input(node):
    joint_input = JointInput([LEG], 0.5, lambda: 0)
    for n, knee in enumerate((-2.0, -7.0, -8.5, 6.2)):
        joint_input.feed(Message(1, n, LEG.joint_names, (0.0, 0.0, 0.0, knee, 0.0, 0.0)).cdr())
    assert joint_input.take_counts(0).joints['looks_like_degrees'] == {KNEE: '-8.5'}


def test_what_is_published_is_said_at_once_and_a_change_with_the_next_second(node):
    node = Node()
    node.signs.configured(['publishing a'], ['doubtful'])
    assert node.said == ['warning: doubtful', 'info: publishing a']
    for line in ('b', 'c', 'a', 'd'):
        node.signs.configured([f'publishing {line}'], ['doubtful'])
    assert node.said[2:] == []
    assert node.seconds(3, ready=0) == ['info: publishing d']
    node.signs.configured(['publishing d'], ['doubtful'])
    assert node.seconds(3, ready=0) == []


def test_warnings_of_one_reason_are_heard_at_once_and_then_every_five_seconds(monkeypatch):
    now, heard = [100.0], []
    monkeypatch.setattr('time.monotonic', lambda: now[0])
    warn = ThrottledWarnings(heard.append)
    for _ in range(3):
        warn('stale_joint', 'l_knee')
        warn('malformed', 'name')
    assert heard == ['stale_joint: l_knee', 'malformed: name']
    for elapsed, more in ((4.9, []), (0.2, ['stale_joint: l_knee (and 3 more)']),
                          (5.1, ['stale_joint: l_knee'])):
        heard.clear()
        now[0] += elapsed
        warn('stale_joint', 'l_knee')
        assert heard == more
