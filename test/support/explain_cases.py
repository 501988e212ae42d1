"""The chains that `leg_fk explain` is tried on, and running it."""

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from icub_leg_fk.__main__ import main
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / 'config' / 'examples'

CASES = [
    *((None, name, version, frame) for name in ('left_leg', 'right_leg')
      for version in ('v1', 'v2_5', 'v3') for frame in ('dh', 'sole')),
    (None, 'head_imu', 'v2', 'dh'),
    (EXAMPLES / 'cylindrical_arm.yaml', 'arm', 'v1', 'dh'),
    (EXAMPLES / 'ur5.yaml', 'ur5', 'series_3', 'dh'),
    (EXAMPLES / 'panda.yaml', 'panda', 'fci', 'flange'),
    (HERE / 'odd_arm.yaml', 'odd_arm', 'v1', 'dh'),
    (HERE / 'odd_arm.yaml', 'odd_arm', 'v1', 'sole'),
]


def _words_and_chain(file, name, version, frame):
    words = [name, '--version', version, '--foot-frame', frame]
    chain = Catalog.load(file).chain(name, version, frame)
    return words + (['-k', str(file)] if file else []), chain


def _each_of(cases):
    return pytest.mark.parametrize(('words', 'chain'), [_words_and_chain(*case) for case in cases],
                                   ids=['-'.join(case[1:]) for case in cases])


every_chain = _each_of(CASES)
one_chain_of_each_kind = _each_of([CASES[2], CASES[11], *CASES[12:]])


LONG_ARM = """\
units: {length: mm, angle: deg}
chains:
  arm:
    tip: tip
    root_frame: base
    joints: [j0, j1, j2, j3, j4, j5, j6, j7, j8, j9, j10, j11, j12]
    tip_frames: {dh: {frame: tip}}
    versions:
      v1:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0, d: 0, alpha: 90, offset: 0, type: prismatic}
          - {a: 10, d: 0, alpha: 0, offset: 0}
          - {a: 0, d: 0, alpha: 90, offset: 0}
""" + 9 * '          - {a: 0, d: 0, alpha: 0, offset: 0, type: prismatic}\n' + (
    '          - {a: 10, d: 0, alpha: 0, offset: 0}\n')
"""More than ten joints, of which 1 and 2 turn about parallel axes, and 12 turns too."""


def explain(*words):
    """Return what `leg_fk explain` prints."""
    with redirect_stdout(StringIO()) as output:
        assert main(['explain', *map(str, words)]) == 0
    return output.getvalue()


def positions(chain, seed):
    return np.random.default_rng(seed).uniform(-1, 1, chain.n).tolist()


def in_metres(T):
    T = np.array(T, dtype=float)
    T[:3, 3] /= 1000
    return T
