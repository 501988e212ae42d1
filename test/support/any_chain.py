"""Any chain for hypothesis: random tables, all joint types and signs, right angles, odd twists."""

from collections.abc import Sequence
from math import pi

from hypothesis import strategies as st
from icub_leg_fk.kinematics import Chain, DHLink
import numpy as np
from support.oracle import quaternion_to_matrix

LENGTHS = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-2, 2))
ANGLES = st.one_of(
    st.sampled_from([0.0, pi / 2, -pi / 2, pi, -pi, 3 * pi / 2, 1e-9, -1e-300, pi / 2 + 1e-12,
                     pi - 1e-12]),
    st.floats(-4, 4))


def links(joint_types: Sequence[str]) -> st.SearchStrategy[DHLink]:
    return st.builds(DHLink, a=LENGTHS, d=LENGTHS, alpha=ANGLES, offset=ANGLES,
                     joint_type=st.sampled_from(joint_types), gain=st.sampled_from([1, 1, -1, 0.5, -2.0]))


LINKS = links(['revolute', 'revolute', 'prismatic', 'fixed'])


@st.composite
def transforms(draw: st.DrawFn) -> np.ndarray:
    quaternion = np.array([draw(ANGLES) for _ in range(4)])
    length = np.linalg.norm(quaternion)
    T = np.eye(4)
    if length > 1e-3:
        T[:3, :3] = quaternion_to_matrix(quaternion / length)
    T[:3, 3] = [draw(LENGTHS) for _ in range(3)]
    return T


def chain_of(links: Sequence[DHLink], T_root_0: np.ndarray | None = None,
             T_n_tip: np.ndarray | None = None) -> Chain:
    joints = [i for i, link in enumerate(links) if link.joint_type != 'fixed']
    return Chain(
        name='any', version='', root_frame='root', tip='tip',
        joint_names=tuple(f'joint_{i}' for i in joints), links=tuple(links),
        T_root_0=np.eye(4) if T_root_0 is None else T_root_0,
        T_n_tip=np.eye(4) if T_n_tip is None else T_n_tip)


@st.composite
def row_lists(draw: st.DrawFn) -> list[DHLink]:
    """Return up to seven rows, at least one of them with a joint."""
    rows = draw(st.lists(LINKS, max_size=6))
    rows.insert(draw(st.integers(0, len(rows))), draw(links(['revolute', 'prismatic'])))
    return rows


CHAINS = st.builds(chain_of, row_lists(), transforms(), transforms())


@st.composite
def chains_and_positions(draw: st.DrawFn) -> tuple[Chain, list[list[float]]]:
    chain = draw(CHAINS)
    q = st.lists(ANGLES, min_size=chain.n, max_size=chain.n)
    return chain, draw(st.lists(q, min_size=1, max_size=3))
