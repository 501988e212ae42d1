"""The chains that `leg_fk explain` is tried on, and running it."""

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.tools.leg_fk import main
import numpy as np
import pytest

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / 'config' / 'examples'

CASES = [
    *((None, name, version, frame) for name in ('left_leg', 'right_leg')
      for version in ('v1', 'v2_5', 'v3') for frame in ('dh', 'sole')),
    (None, 'head_imu', 'v2', 'dh'),
    (EXAMPLES / 'cylindrical_arm.yaml', 'arm', 'v1', 'dh'),
    (EXAMPLES / 'ur5.yaml', 'ur5', 'series_3', 'dh'),
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


def explain(*words):
    """Return what `leg_fk explain` prints."""
    with redirect_stdout(StringIO()) as output:
        assert main(['explain', *map(str, words)]) == 0
    return output.getvalue()


def positions(chain, seed):
    return np.random.default_rng(seed).uniform(-1, 1, len(chain.links)).tolist()


def in_metres(T):
    T = np.array(T, dtype=float)
    T[:3, 3] /= 1000
    return T
