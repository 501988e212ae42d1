"""How far chains are apart, and what the best constants at both ends make up for."""

from dataclasses import replace

from icub_leg_fk.kinematics import DHLink, load_chain
from icub_leg_fk.kinematics.difference import (
    difference,
    distance,
    fit,
    postures,
    turn_in_words,
    turn_of_axes,
)
from icub_leg_fk.kinematics.rotation import turns_about
import numpy as np
import pytest
from support.any_chain import chain_of

LEG = load_chain('left_leg')
Z = np.array([0.0, 0.0, 1.0])


def moved(axis, degrees, by=(0, 0, 0)):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turns_about(axis, np.radians(degrees)), by
    return T


def test_a_moved_and_turned_tip_is_that_far_away():
    other = replace(LEG, T_n_tip=moved(Z, 2, (0.003, 0, 0.004)))
    found = difference(LEG.forward, other.forward, postures(LEG, 100))
    assert found == pytest.approx((5, 5, 2, 2))


def test_postures_are_the_same_at_every_call_and_fill_the_ranges():
    ranges = [{'lower': 1, 'upper': 2}, {}, {'lower': 9}]
    chain = chain_of([DHLink(0, 0, 0, **limits) for limits in ranges])
    Q = np.array([*postures(chain, 1000).values()])
    assert np.array_equal(Q, [*postures(chain, 1000).values()])
    assert Q.min(axis=1) == pytest.approx([1, -np.pi, 9], abs=0.1)
    assert Q.max(axis=1) == pytest.approx([2, np.pi, 9], abs=0.1)
    assert np.abs([*postures(chain, 1000, 1.2, whole_range=False).values()]).max() < 1.2


@pytest.mark.parametrize('axis', [*np.eye(3), np.array([0.6, 0.0, -0.8])], ids=str)
@pytest.mark.parametrize('degrees', [0, 45, 90, 180])
def test_constants_at_both_ends_are_found_however_the_root_is_turned(axis, degrees):
    ours = LEG.forward(postures(LEG, 100, 1.2))
    theirs = moved(axis, degrees, (0.1, 0.2, 0.3)) @ ours @ moved(Z, 70, (0, -0.1, 0))
    X, Y = fit(ours, theirs)
    found = distance(X @ ours @ Y, theirs)
    assert found.mm < 1e-6 and found.deg < 1e-6
    assert X[:3, :3] == pytest.approx(turns_about(axis, np.radians(degrees)), abs=1e-9)


def test_what_constants_cannot_make_up_for_is_left():
    links = (
        *LEG.links[:3],
        replace(LEG.links[3], a=LEG.links[3].a - 0.02),
        *LEG.links[4:],
    )
    positions = postures(LEG, 400, 1.2)
    ours, theirs = LEG.forward(positions), replace(LEG, links=links).forward(positions)
    X, Y = fit(ours, theirs)
    assert (
        2
        < distance(X @ ours @ Y, theirs).mm
        < distance(ours, theirs).mm
        == pytest.approx(20)
    )


@pytest.mark.parametrize(
    ('axis', 'degrees', 'words'),
    [
        (Z, 0, ''),
        (Z, 0.3, ''),
        (Z, 90, '90 deg about z'),
        (-Z, 90, '90 deg about - z'),
        (-Z, 180, '180 deg about z'),
        (np.sqrt([0.2, 0, 0.8]), 45, '45 deg about 0.5 x + z'),
        (np.sqrt([0.5, 0, 0.5]), 180, '180 deg about x + z'),
    ],
)
def test_turns_in_words(axis, degrees, words):
    assert turn_in_words(turns_about(axis, np.radians(degrees))) == words


def test_axes_are_turned_by_right_angles():
    ours = LEG.forward(postures(LEG, 20))
    T = turn_of_axes(ours, ours @ moved(Z, 84) @ moved(np.array([1.0, 0, 0]), 180))
    assert turn_in_words(T[:3, :3]) in ('180 deg about x + y', '180 deg about - x + y')
