"""Prismatic joints: textbook arms against their closed forms (Spong, Robot Modeling, ch. 3)."""

from math import cos, pi, sin
from pathlib import Path

from icub_leg_fk.kinematics import Catalog, Chain
import numpy as np
import pytest

D1, D2, D6 = 0.4, 0.154, 0.263

ARMS = f"""
units: {{length: m, angle: deg}}
chains:
  cylindrical:
    tip: cylindrical_hand
    root_frame: base
    joints: [turn, lift, reach]
    tip_frames: {{dh: {{frame: hand}}}}
    versions:
      spong:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {{a: 0, d: {D1}, alpha:   0, offset: 0}}
          - {{a: 0, d: 0,    alpha: -90, offset: 0, type: prismatic, range: [0, 0.5]}}
          - {{a: 0, d: 0,    alpha:   0, offset: 0, type: prismatic}}
  stanford:
    tip: stanford_hand
    root_frame: base
    joints: [j1, j2, j3, j4, j5, j6]
    tip_frames: {{dh: {{frame: stanford_hand}}}}
    versions:
      spong:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {{a: 0, d: 0,    alpha: -90, offset: 0}}
          - {{a: 0, d: {D2}, alpha:  90, offset: 0}}
          - {{a: 0, d: 0,    alpha:   0, offset: 0, type: prismatic}}
          - {{a: 0, d: 0,    alpha: -90, offset: 0}}
          - {{a: 0, d: 0,    alpha:  90, offset: 0}}
          - {{a: 0, d: {D6}, alpha:   0, offset: 0}}
"""


@pytest.fixture(scope='module')
def catalog(tmp_path_factory: pytest.TempPathFactory) -> Catalog:
    file: Path = tmp_path_factory.mktemp('arms') / 'arms.yaml'
    file.write_text(ARMS)
    return Catalog.load(file)


def cylindrical(t1: float, d2: float, d3: float) -> np.ndarray:
    """Spong, equation (3.12)."""
    return np.array([
        [cos(t1), 0, -sin(t1), -sin(t1) * d3],
        [sin(t1), 0, cos(t1), cos(t1) * d3],
        [0, -1, 0, D1 + d2],
        [0, 0, 0, 1]])


def stanford(t1: float, t2: float, d3: float, t4: float, t5: float, t6: float) -> np.ndarray:
    """Spong, example 3.5."""
    c1, c2, c4, c5, c6 = (cos(t) for t in (t1, t2, t4, t5, t6))
    s1, s2, s4, s5, s6 = (sin(t) for t in (t1, t2, t4, t5, t6))
    wrist = c4 * c5 * c6 - s4 * s6
    r11 = c1 * (c2 * wrist - s2 * s5 * c6) - s1 * (s4 * c5 * c6 + c4 * s6)
    r21 = s1 * (c2 * wrist - s2 * s5 * c6) + c1 * (s4 * c5 * c6 + c4 * s6)
    r31 = -s2 * wrist - c2 * s5 * c6
    wrist = c4 * c5 * s6 + s4 * c6
    r12 = c1 * (-c2 * wrist + s2 * s5 * s6) - s1 * (-s4 * c5 * s6 + c4 * c6)
    r22 = s1 * (-c2 * wrist + s2 * s5 * s6) + c1 * (-s4 * c5 * s6 + c4 * c6)
    r32 = s2 * wrist + c2 * s5 * s6
    r13 = c1 * (c2 * c4 * s5 + s2 * c5) - s1 * s4 * s5
    r23 = s1 * (c2 * c4 * s5 + s2 * c5) + c1 * s4 * s5
    r33 = -s2 * c4 * s5 + c2 * c5
    x = c1 * s2 * d3 - s1 * D2 + D6 * r13
    y = s1 * s2 * d3 + c1 * D2 + D6 * r23
    z = c2 * d3 + D6 * r33
    return np.array([[r11, r12, r13, x], [r21, r22, r23, y], [r31, r32, r33, z], [0, 0, 0, 1]])


def check(chain: Chain, Q: np.ndarray, expected: np.ndarray) -> None:
    assert np.abs(np.array([chain.forward(q) for q in Q]) - expected).max() < 1e-12
    assert np.abs(chain.forward(Q) - expected).max() < 1e-12
    positions = np.array([chain.pose(q)[:3] for q in Q.tolist()])
    assert np.abs(positions - expected[:, :3, 3]).max() < 1e-12


def test_cylindrical_arm_is_the_textbooks(catalog: Catalog) -> None:
    Q = np.random.default_rng(8).uniform((-pi, 0, 0), (pi, 1, 1), (1000, 3))
    check(catalog.chain('cylindrical', 'spong'), Q, np.array([cylindrical(*q) for q in Q]))


def test_stanford_arm_is_the_textbooks(catalog: Catalog) -> None:
    Q = np.random.default_rng(9).uniform(-pi, pi, (1000, 6))
    check(catalog.chain('stanford', 'spong'), Q, np.array([stanford(*q) for q in Q]))


def test_range_of_a_sliding_joint_is_a_length(catalog: Catalog) -> None:
    chain = catalog.chain('cylindrical', 'spong')
    assert chain.out_of_range([9.0, 0.5, -7.0]) == ()
    assert chain.out_of_range([0.0, 0.6, 0.0]) == ('lift',)
