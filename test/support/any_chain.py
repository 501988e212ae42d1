"""Any chain for hypothesis: random tables, joint types and gains, right angles, odd twists."""

from dataclasses import replace
from math import pi

from hypothesis import strategies as st
from icub_leg_fk.kinematics import Chain, DHLink
import numpy as np
from support.oracle import quaternion_to_matrix

LENGTHS = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-2, 2))
ANGLES = st.one_of(
    st.sampled_from(
        [
            0.0,
            pi / 2,
            -pi / 2,
            pi,
            -pi,
            3 * pi / 2,
            1e-9,
            -1e-300,
            pi / 2 + 1e-12,
            pi - 1e-12,
        ]
    ),
    st.floats(-4, 4),
)
GAINS = st.sampled_from([1.0, 1.0, -1.0, 0.5, -2.0])


def links(joint_types):
    return st.builds(
        DHLink,
        a=LENGTHS,
        d=LENGTHS,
        alpha=ANGLES,
        offset=ANGLES,
        joint_type=st.sampled_from(joint_types),
        gain=GAINS,
    )


LINKS = links(['revolute', 'revolute', 'prismatic', 'fixed'])


@st.composite
def transforms(draw):
    quaternion = np.array([draw(ANGLES) for _ in range(4)])
    length = np.linalg.norm(quaternion)
    T = np.eye(4)
    if length > 1e-3:
        T[:3, :3] = quaternion_to_matrix(quaternion / length)
    T[:3, 3] = [draw(LENGTHS) for _ in range(3)]
    return T


def chain_of(links, T_root_0=None, T_n_tip=None, joint_names=()):
    moving = [i for i, link in enumerate(links) if link.joint_type != 'fixed']
    return Chain(
        name='any',
        version='',
        root_frame='root',
        tip='tip',
        joint_names=tuple(joint_names or (f'joint_{i}' for i in moving)),
        links=tuple(links),
        T_root_0=np.eye(4) if T_root_0 is None else T_root_0,
        T_n_tip=np.eye(4) if T_n_tip is None else T_n_tip,
    )


@st.composite
def row_lists(draw):
    """Return up to seven rows, at least one of them with a joint."""
    rows = draw(st.lists(LINKS, max_size=6))
    rows.insert(draw(st.integers(0, len(rows))), draw(links(['revolute', 'prismatic'])))
    return rows


@st.composite
def rows_that_follow(draw):
    """Return rows that name their joints, and the joints: several a joint, in any order."""
    rows = draw(row_lists())
    moving = [i for i, row in enumerate(rows) if row.joint_type != 'fixed']
    joints = [f'joint_{i}' for i in range(draw(st.integers(1, len(moving))))]
    followers = st.lists(
        st.sampled_from(joints),
        min_size=len(moving) - len(joints),
        max_size=len(moving) - len(joints),
    )
    names = draw(st.permutations([*joints, *draw(followers)]))
    for i, name in zip(moving, names, strict=True):
        rows[i] = replace(rows[i], joint=name)
    return rows, joints


IN_ORDER = st.builds(chain_of, row_lists(), transforms(), transforms())
FOLLOWING = st.builds(
    lambda rows, root, tip: chain_of(rows[0], root, tip, rows[1]),
    rows_that_follow(),
    transforms(),
    transforms(),
)
CHAINS = st.one_of(IN_ORDER, FOLLOWING)


@st.composite
def chains_and_positions(draw, chains=CHAINS):
    chain = draw(chains)
    q = st.lists(ANGLES, min_size=chain.n, max_size=chain.n)
    return chain, draw(st.lists(q, min_size=1, max_size=3))
