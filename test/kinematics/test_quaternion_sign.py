"""The quaternion does not flip: on a recorded walk, on any path near q = 0."""

from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.recorded_walk import (
    needs_recorded_walk,
    read_recorded_walk,
    read_synthetic_walk,
)

CATALOG = Catalog.load()
CHAINS = [
    CATALOG.chain(name, version, frame)
    for name, entry in CATALOG.chains.items()
    for version, table in entry.versions.items()
    for frame in table.tip_frames
]


def flips(chain, Q):
    """Count the steps at which a quaternion turns into its negative."""
    quaternions = chain.poses(Q)[:, 3:]
    return int((np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0).sum())


def check_walk(names, positions, frame):
    for leg in ('left_leg', 'right_leg'):
        chain = CATALOG.chain(leg, 'v2_5', frame)
        columns = [names.index(name) for name in chain.joint_names]
        assert flips(chain, positions[:, columns]) == 0


@needs_recorded_walk
@pytest.mark.parametrize('frame', ['dh', 'sole'])
def test_no_flip_on_the_recorded_walk(frame):
    names, _, positions, _ = read_recorded_walk()
    check_walk(names, positions, frame)


@pytest.mark.parametrize('frame', ['dh', 'sole'])
def test_no_flip_on_the_synthetic_walk(frame):
    check_walk(*read_synthetic_walk(), frame)


@given(st.sampled_from(CHAINS), st.data())
def test_no_flip_on_any_path_within_half_a_turn_of_zero(chain, data):
    """Straight paths between postures inside the ranges, cut where half a turn is reached."""
    inside = [
        st.floats(max(lower, -np.pi), min(upper, np.pi))
        for lower, upper in zip(chain.lower.tolist(), chain.upper.tolist(), strict=True)
    ]
    start, end = np.array(data.draw(st.tuples(st.tuples(*inside), st.tuples(*inside))))
    path = start + np.linspace(0, 1, 200)[:, None] * (end - start)
    zero = chain.forward(np.zeros(chain.n))[:3, :3]
    traces = np.einsum('ij,nij->n', zero, chain.forward(path)[:, :3, :3])
    near = np.arccos(np.clip((traces - 1) / 2, -1, 1)) < np.pi - 0.02
    quaternions = chain.poses(path)[:, 3:]
    dots = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    assert (dots[near[1:] & near[:-1]] > 0).all()
