"""One pose and many poses beside Pinocchio; `leg_fk pose`'s start."""

from collections.abc import Callable
import subprocess
import sys
import time
from typing import Any

from bench.report import ratio, Report
from icub_leg_fk.kinematics import Catalog, Chain
import numpy as np

_READINGS = 9
_MANY = 100_000
_IMPORTS = 'import numpy, yaml, lxml.etree'
_TOLERANCE = (
    1e-9  # m, and each rotation entry; so that nobody is timed on another robot
)

One = Callable[[Any], Any]
"""Computes one pose with its quaternion."""


def measure_start(report: Report, quick: bool) -> None:
    """Add the time that `leg_fk pose` takes from the shell, beside its libraries alone."""
    commands = {
        'leg_fk pose left_leg': [
            '-m',
            'icub_leg_fk',
            'pose',
            'left_leg',
            '--degrees',
            *'000000',
        ],
        f'python -c "{_IMPORTS}"': ['-c', _IMPORTS],
    }
    seconds: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(2 if quick else 15):
        for name, words in commands.items():
            began = time.perf_counter()
            subprocess.run(
                [sys.executable, *words], check=True, stdout=subprocess.DEVNULL
            )
            seconds[name].append(time.perf_counter() - began)
    report.note('\nthe command from the shell')
    for name, readings in seconds.items():
        report.row(name, readings, 's')
    ours, imports = seconds.values()
    report.row('leg_fk pose / imports', ratio(ours, imports), 'x', at_most=1.5)


def measure_kinematics(report: Report, quick: bool) -> None:
    """Add one pose and many poses, in turns with each library."""
    chain = Catalog.load().chain('left_leg', 'v2_5', 'dh')
    Q = np.random.default_rng(5).uniform(chain.lower, chain.upper, (_MANY, chain.n))
    few = Q[:100] if quick else Q[:1000]
    report.note('\nkinematics: left_leg v2_5, pose with quaternion')
    ways: dict[str, tuple[One, Any]] = {'here': (chain.pose, few.tolist())}
    try:
        ways['Pinocchio'] = _pinocchio(chain, few), list(few)
    except ImportError as error:
        report.note(f'  Pinocchio: not measured: {error}')
    one: dict[str, list[float]] = {name: [] for name in ways}
    many, loop = [], []
    for _ in range(3 if quick else _READINGS):
        for name, (pose, vectors) in ways.items():
            one[name].append(_microseconds(len(few), _call, pose, vectors))
        many.append(_microseconds(len(Q), chain.poses, Q))
        if 'Pinocchio' in ways:
            loop.append(_microseconds(len(few), _fill, *ways['Pinocchio']))
    for name, readings in one.items():
        report.row(f'one pose, {name}', readings, 'us')
    report.row('many poses, each, here', many, 'us')
    if loop:
        report.row('many poses, each, a loop over Pinocchio', loop, 'us')
        ratios = ratio(one['here'], one['Pinocchio'])
        report.row('one pose / Pinocchio', ratios, 'x', at_most=6.0)
        ratios = ratio(loop, many)
        report.row('many poses, loop over Pinocchio / here', ratios, 'x', at_least=4.0)


def _call(pose: One, vectors: Any) -> None:
    for q in vectors:
        pose(q)


def _fill(pose: One, vectors: Any) -> None:
    out = np.empty((len(vectors), 7))
    for i, q in enumerate(vectors):
        out[i] = pose(q)


def _microseconds(count: int, work: Callable[..., object], *arguments: Any) -> float:
    """Return what each of so many things costs that are worked on."""
    began = time.perf_counter()
    work(*arguments)
    return (time.perf_counter() - began) / count * 1e6


def _pinocchio(chain: Chain, Q: Any) -> One:
    import pinocchio as pin

    model = pin.Model()
    joint, before = 0, pin.SE3(chain.T_root_0)
    for i, link in enumerate(chain.links):
        turned = pin.SE3(pin.utils.rotate('z', link.offset), np.zeros(3))
        joint = model.addJoint(joint, pin.JointModelRZ(), before * turned, f'joint_{i}')
        # Rz(theta) Tz(d) Tx(a) Rx(alpha), of which Rz(offset) may stand before the joint's turn.
        before = pin.SE3(
            pin.utils.rotate('x', link.alpha), np.array([link.a, 0.0, link.d])
        )
    tip = model.addFrame(pin.Frame('tip', joint, 0, before, pin.FrameType.OP_FRAME))
    data = model.createData()

    def pose(q: Any) -> Any:
        pin.forwardKinematics(model, data, q)
        return pin.SE3ToXYZQUAT(pin.updateFramePlacement(model, data, tip))

    pose(Q[0])
    if np.abs(data.oMf[tip].homogeneous - chain.forward(Q[0])).max() > _TOLERANCE:
        raise AssertionError('Pinocchio computes another robot')
    return pose
