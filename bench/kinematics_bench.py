"""Point 5: one pose and many poses, beside Pinocchio, PyKDL and roboticstoolbox."""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys
import tracemalloc
from typing import Any

from bench.kinematics_peers import PEERS, readings_us
from bench.measure import difference, figure, ratio
from bench.report import Report
from icub_leg_fk.kinematics import Catalog, Chain
import numpy as np

_PEERS_FILE = Path(__file__).with_name('kinematics_peers.py')
_PYTHONS = (sys.executable, '/usr/bin/python3')  # Debian's PyKDL is in the system's Python only
_MANY_HOW = {'pinocchio': 'loop over many', 'pykdl': 'loop over many',
             'roboticstoolbox': 'many matrices in one call'}
_TOLERANCE = 1e-9  # m, and each rotation entry; so that nobody is timed on another robot
_MANY = 100_000


def measure_kinematics(report: Report, seconds: float) -> None:
    """Add the rows of point 5; each figure takes about `seconds`."""
    chain = Catalog.load(None).chain('left_leg', 'v2_5', 'dh')
    rng = np.random.default_rng(5)
    Q = rng.uniform(chain.lower, chain.upper, (_MANY, chain.n))
    vectors = [tuple(q) for q in Q[:1000].tolist()]

    def one() -> None:
        for q in vectors:
            chain.pose(q)
    ours_one = readings_us(one, len(vectors), seconds)
    ours_many = readings_us(lambda: chain.poses(Q), len(Q), seconds)
    peers = {name: _peer(name, chain, vectors, seconds) for name in PEERS}
    report.section('5. kinematics: left_leg v2_5')
    report.row('one pose with quaternion', figure(ours_one), 'us', at_most=3.5)
    report.row('many poses with quaternions', figure(ours_many), 'us', at_most=0.25)
    for name, peer in peers.items():
        if isinstance(peer, str):
            report.note(f'{name}: not measured: {peer}')
            continue
        label = f'{name} {peer["version"]}'.strip()
        report.row(f'{label}, one pose with quaternion', figure(peer['one']), 'us')
        report.row(f'{label}, {_MANY_HOW[name]}', figure(peer['many']), 'us')
    if not isinstance(peers['pinocchio'], str):
        report.row("many poses, Pinocchio's loop / ours",
                   ratio(peers['pinocchio']['many'], ours_many), 'x', at_least=8.0)
    beyond = [_memory_beyond_result(chain, Q[:count]) for count in (_MANY // 10, _MANY)]
    report.row(f'memory beyond the result: {_MANY} poses less {_MANY // 10}',
               difference([beyond[1]], [beyond[0]]), 'MB', at_most=0.1)


def _memory_beyond_result(chain: Chain, Q: Any) -> float:
    """Return the peak of what `poses` allocates beyond what it returns [MB]."""
    tracemalloc.start()
    result = chain.poses(Q)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return float((peak - result.nbytes) / 1e6)


def _peer(name: str, chain: Chain, vectors: list[tuple[float, ...]],
          seconds: float) -> dict[str, Any] | str:
    """Return a library's figures, or why there are none."""
    task = json.dumps({
        'links': [(link.a, link.d, link.alpha, link.offset) for link in chain.links],
        'T_root_0': chain.T_root_0.tolist(), 'Q': vectors, 'seconds': seconds})
    problems = []
    for python in _PYTHONS:
        run = subprocess.run([python, str(_PEERS_FILE), name], input=task, text=True,
                             capture_output=True, check=False)
        if run.returncode == 0:
            answer: dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
            expected = [chain.forward(q) for q in vectors[:len(answer['poses'])]]
            error = np.abs(np.array(answer['poses']) - expected).max()
            if error > _TOLERANCE:
                return f'computes another robot, {error:.1e} off'
            return answer
        problems.append(run.stderr.strip().splitlines()[-1])
    return '; '.join(dict.fromkeys(problems))
