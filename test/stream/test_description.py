"""Descriptions that come one after the other, and tables held against them, without ROS."""

from dataclasses import replace
import struct

from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Catalog, Urdf
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.description import compared, Description
import numpy as np
import pytest
from support.described_robots import needs_real_robots, own_description, REAL
from support.oracle import rotation_z, translation
from support.robots import joint, robot

TOPIC = '/robot_description'
TABLES = Catalog.load()


def string(text, encoding='utf-8'):
    """Return a serialized std_msgs/String."""
    data = text.encode(encoding) + b'\0'
    return struct.pack('<4sI', b'\0\1\0\0', len(data)) + data


def urdf(text):
    return Urdf.parse(text.encode(), TOPIC)


def texts(description):
    return [str(note) for note in description.announcement()]


def described(text, **values):
    """Return what is known of a description by one who computes with tables."""
    description = Description(TOPIC, None)
    description.configure(Configuration.checked(TABLES, **values))
    description.take(string(text))
    return description


GOOD = {name: robot([joint(0)]).replace('made', name) for name in ('one', 'two')}
BAD = {
    'half': GOOD['one'][:60],
    'not taken': GOOD['one'].replace('made', 'refused').replace('one', 'refused'),
    'no String': None,
}


@given(st.lists(st.sampled_from([*GOOD, *BAD])))
def test_the_last_that_can_be_used_is_used(names):
    description, used = after(names)
    good = [name for name in names if name in GOOD]
    assert used == good
    assert description.value('any chain') == (good[-1] if good else '')


@given(st.lists(st.sampled_from([*GOOD, *BAD])))
def test_one_that_cannot_be_used_is_an_error_until_another_one_comes(names):
    description, used = after(names)
    levels = [note.level for note in description.notes(['/robot_state_publisher'])]
    if names and names[-1] in BAD:
        assert levels == ['error']
        stays = 'nothing is published until another one comes'
        if used:
            stays = 'the one before stays'
        assert texts(description)[0].endswith(f'; {stays}')
    else:
        assert levels == ([] if names else ['warning'])


def after(names):
    """Return a description to which some have come, and the names of those that were used."""
    used = []

    def use(urdf):
        if urdf.name == 'refused':
            raise LegFKError('it is refused')
        used.append(urdf.name)

    description = Description(TOPIC, use)
    for name in names:
        text = (GOOD | BAD)[name]
        description.take(b'' if text is None else string(text))
    return description, used


@pytest.mark.parametrize(
    'data', [b'', b'\0\1\0\0', string('x')[:-1], string('x' * 9)[:12]]
)
def test_bytes_that_are_no_string_are_a_fault(data):
    description = Description(TOPIC, lambda urdf: None)
    description.take(data)
    [note] = description.notes([])
    assert (note.level, 'String: ' in note.text) == ('error', True)


def test_bytes_that_are_no_text_are_read_where_nothing_needs_them():
    text = own_description('v2_5').replace('<link', '<!-- \xe9 --><link', 1)
    description = Description(TOPIC, None)
    description.take(string(text, 'latin-1'))
    assert description.value('') == 'robot_v2_5'


def test_who_computes_with_tables_is_told_how_far_they_are():
    description = described(own_description('v2_5'))
    assert texts(description) == [
        "left_leg: l_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's own",
        "right_leg: r_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's own",
    ]
    assert description.notes(['/one', '/two']) == []
    description.configure(Configuration.checked(TABLES, chains=['left_leg=v1']))
    [line] = texts(description)
    way = 'description_from_topic:=true computes with the description on /robot_description'
    assert line.endswith(f'; {way}')
    assert description.value('left_leg') in line


@pytest.mark.parametrize(
    ('mm', 'deg', 'is_far'),
    [
        (0.999, 0.0, False),
        (1.001, 0.0, True),
        (0.0, 0.099, False),
        (0.0, 0.101, True),
    ],
)
def test_from_a_millimetre_or_a_tenth_of_a_degree_on_it_is_another_robot(
    mm, deg, is_far
):
    leg = TABLES.chain('left_leg', 'v2_5')
    moved = translation(0, 0, mm / 1000) @ leg.T_root_0
    turned = leg.T_n_tip @ rotation_z(np.radians(deg))
    other = replace(leg, T_root_0=moved, T_n_tip=turned)
    assert compared(other, urdf(own_description('v2_5'))) == (
        f"l_foot_dh_frame is up to {mm:.2f} mm and {deg:.2f} deg off the robot's own",
        is_far,
    )


def test_joints_with_a_prefix_are_those_of_the_description():
    description = described(own_description('v2_5'), joint_prefix='icub1/')
    assert all('up to 0.00 mm' in line for line in texts(description))


@needs_real_robots
def test_real_robots():
    """As FACTS has it: beside iCubGenova04 the feet of v2_5 are 10 to 12 mm off."""
    legs = TABLES.select(['left_leg', 'right_leg'])
    for leg in legs:
        found = compared(leg, urdf(REAL['iCubGenova04'].read_text()))
        assert (found.text[1:26], found.is_far) == ('_foot_dh_frame is up to 1', True)
    v3 = compared(
        TABLES.chain('right_leg', 'v3'), urdf(REAL['iCubGenova09'].read_text())
    )
    assert v3 == ("r_sole is up to 0.00 mm and 0.00 deg off the robot's own", False)


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        (robot([joint(0)]), f'no frame root_link in {TOPIC}'),
        (
            robot([joint(0)]).replace('l0', 'root_link'),
            f'no frame l_foot_dh_frame or l_sole in {TOPIC}',
        ),
        (
            robot([joint(0)]).replace('l0', 'root_link').replace('l1', 'l_sole'),
            f'the joints from root_link to l_sole are j0 in {TOPIC}',
        ),
        (
            robot([joint(0, 'floating')])
            .replace('l0', 'root_link')
            .replace('l1', 'l_sole'),
            f"{TOPIC}: joint 'j0' is floating; allowed: revolute, continuous, prismatic, fixed",
        ),
    ],
    ids=['root', 'tip', 'joints', 'type'],
)
def test_what_cannot_be_compared_says_why(text, reason):
    found = compared(TABLES.chain('left_leg'), urdf(text))
    assert found == (f'not compared: {reason}', False)


def test_transforms_that_the_description_has_are_a_warning():
    def warnings(**values):
        description = described(own_description('v2_5'), **values)
        return [
            note.text
            for note in description.announcement()
            if note.key == 'shared_frames'
        ]

    [line] = warnings(publish_tf=True)
    assert line.startswith(
        'publish_tf sends l_foot_dh_frame and r_foot_dh_frame, which the descr'
    )
    assert 'fixed frames on /tf_static, and what comes on /tf displaces those' in line
    assert warnings() == []
    assert warnings(publish_tf=True, frame_prefix='fk/') == []
    assert (
        'sends l_sole, which'
        in warnings(publish_tf=True, chains=['left_leg'], foot_frame='sole')[0]
    )
