"""The chains that `leg_fk explain` is tried on, and running it."""

from contextlib import redirect_stdout
from functools import cache
from io import StringIO
import json
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from icub_leg_fk.__main__ import main
from icub_leg_fk.commands import explain as command
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.tools.explanation import explain as work_out
import numpy as np
import pytest

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / 'config' / 'examples'
ODD_ARM = HERE / 'odd_arm.yaml'


def explain(*words):
    """Return what `leg_fk explain` prints."""
    return _explain(*map(str, words))


# Formulas take seconds, so each is worked out once, whatever forms of it are printed.
@cache
def _worked_out(chain, q, exact):
    return work_out(chain, q, exact=exact)


def _worked_out_once(chain, q, *, exact):
    return _worked_out(chain, None if q is None else tuple(q), exact)


@cache
def _explain(*words):
    with (
        patch.object(command, 'explain', _worked_out_once),
        redirect_stdout(StringIO()) as output,
    ):
        assert main(['explain', *words]) == 0
    return output.getvalue()


class Case(NamedTuple):
    """A chain in one of its tip's frames."""

    name: str
    frame: str
    file: Path | None = None

    @property
    def chain(self):
        return Catalog.load(self.file).chain(self.name, frame=self.frame)

    def explain(self, *words):
        file = ['-k', self.file] if self.file else []
        return explain(self.name, '--foot-frame', self.frame, *file, *words)

    def json(self, *words):
        return json.loads(self.explain('--json', *words))

    def radians(self, seed):
        """Return joint positions, and the words that give them."""
        q = np.random.default_rng(seed).uniform(-1, 1, self.chain.n).tolist()
        return q, ['--radians', *q]


LEG = Case('left_leg', 'dh')
HEAD = Case('head_imu', 'dh')
ARM = Case('arm', 'dh', EXAMPLES / 'cylindrical_arm.yaml')
UR5 = Case('ur5', 'dh', EXAMPLES / 'ur5.yaml')
PANDA = Case('panda', 'flange', EXAMPLES / 'panda.yaml')
ODD = Case('odd_arm', 'sole', ODD_ARM)

OF_EACH_KIND = [LEG, Case('right_leg=v3', 'sole'), HEAD, ARM, UR5, PANDA, ODD]
LEGS = [
    Case(f'{side}_leg={version}', frame)
    for side in ('left', 'right')
    for version in ('v1', 'v2_5', 'v3')
    for frame in ('dh', 'sole')
]


def _name(case):
    return f'{case.name}-{case.frame}'


every_chain = pytest.mark.parametrize(
    'case', [*LEGS, HEAD, ARM, UR5, PANDA, ODD, ODD._replace(frame='dh')], ids=_name
)
one_chain_of_each_kind = pytest.mark.parametrize('case', OF_EACH_KIND, ids=_name)


def in_metres(T):
    """Return a transform in mm in metres."""
    T = np.array(T, dtype=float)
    T[:3, 3] /= 1000
    return T
