"""Other libraries' forward kinematics of a DH chain: `python kinematics_peers.py NAME < TASK`.

A script of its own, free of this project, so that it also runs in the system's Python, which is
where Debian's PyKDL is. TASK is JSON: `links` (rows a, d, alpha, offset), `T_root_0` (4x4), `Q`
(N joint vectors) and `seconds`. The answer is JSON: `version`, `poses` (of the first joint
vectors, as 4x4 matrices), and readings [us per pose] of `one` (pose and quaternion, dropped) and
`many` (what comes of all of Q, kept: poses with quaternions by a loop as the library's examples
write it, or matrices by one call where the library takes all of Q).
"""

from __future__ import annotations

from collections.abc import Callable
import json
import sys
import time
from typing import Any

_READINGS = 7
_COMPARED = 20


def readings_us(function: Callable[[], object], poses: int, seconds: float) -> list[float]:
    """Time a function that computes some poses, in several readings of some length."""
    start = time.perf_counter()
    function()
    once = time.perf_counter() - start
    repeats = max(1, round(seconds / _READINGS / max(once, 1e-9)))
    readings = []
    for _ in range(_READINGS):
        start = time.perf_counter()
        for _ in range(repeats):
            function()
        readings.append((time.perf_counter() - start) / repeats / poses * 1e6)
    return readings


def pinocchio(task: dict[str, Any]) -> dict[str, Any]:
    """Pinocchio's Python binding: forwardKinematics, SE3ToXYZQUAT."""
    import numpy as np
    import pinocchio as pin
    model = pin.Model()
    joint, before = 0, pin.SE3(np.array(task['T_root_0']))
    for i, (a, d, alpha, offset) in enumerate(task['links']):
        turned = pin.SE3(pin.utils.rotate('z', offset), np.zeros(3))
        joint = model.addJoint(joint, pin.JointModelRZ(), before * turned, f'joint_{i}')
        # Rz(theta) Tz(d) Tx(a) Rx(alpha), of which Rz(offset) may stand before the joint's turn.
        before = pin.SE3(pin.utils.rotate('x', alpha), np.array([a, 0.0, d]))
    tip = model.addFrame(pin.Frame('tip', joint, 0, before, pin.FrameType.OP_FRAME))
    data = model.createData()
    Q = np.array(task['Q'])

    def one() -> None:
        for q in Q:
            pin.forwardKinematics(model, data, q)
            pin.SE3ToXYZQUAT(pin.updateFramePlacement(model, data, tip))

    out = np.empty((len(Q), 7))

    def loop() -> None:
        for i, q in enumerate(Q):
            pin.framesForwardKinematics(model, data, q)
            out[i] = pin.SE3ToXYZQUAT(data.oMf[tip])

    def matrix(q: Any) -> Any:
        pin.forwardKinematics(model, data, q)
        return pin.updateFramePlacement(model, data, tip).homogeneous.tolist()
    return {'version': pin.__version__, 'poses': [matrix(q) for q in Q[:_COMPARED]],
            'one': readings_us(one, len(Q), task['seconds']),
            'many': readings_us(loop, len(Q), task['seconds'])}


def pykdl(task: dict[str, Any]) -> dict[str, Any]:
    """PyKDL: ChainFkSolverPos_recursive, Rotation.GetQuaternion."""
    import PyKDL as kdl
    root = task['T_root_0']
    chain = kdl.Chain()
    chain.addSegment(kdl.Segment(kdl.Joint(kdl.Joint.Fixed), kdl.Frame(
        kdl.Rotation(*(root[i][j] for i in range(3) for j in range(3))),
        kdl.Vector(*(root[i][3] for i in range(3))))))
    for a, d, alpha, offset in task['links']:
        chain.addSegment(kdl.Segment(kdl.Joint(kdl.Joint.RotZ),
                                     kdl.Frame.DH(a, alpha, d, offset)))
    solver = kdl.ChainFkSolverPos_recursive(chain)
    Q = []
    for values in task['Q']:
        q = kdl.JntArray(len(values))
        for i, value in enumerate(values):
            q[i] = value
        Q.append(q)
    frame = kdl.Frame()

    def one() -> None:
        for q in Q:
            solver.JntToCart(q, frame)
            frame.M.GetQuaternion()

    def loop() -> None:
        out = []
        for q in Q:
            solver.JntToCart(q, frame)
            out.append((*frame.p, *frame.M.GetQuaternion()))

    def matrix(q: Any) -> list[list[float]]:
        solver.JntToCart(q, frame)
        return [[*(frame.M[i, j] for j in range(3)), frame.p[i]] for i in range(3)] + [
            [0.0, 0.0, 0.0, 1.0]]
    return {'version': getattr(kdl, '__version__', ''),
            'poses': [matrix(q) for q in Q[:_COMPARED]],
            'one': readings_us(one, len(Q), task['seconds']),
            'many': readings_us(loop, len(Q), task['seconds'])}


def roboticstoolbox(task: dict[str, Any]) -> dict[str, Any]:
    """Corke's roboticstoolbox: DHRobot.fkine, UnitQuaternion."""
    from importlib.metadata import version

    import numpy as np
    import roboticstoolbox as rtb
    from spatialmath import SE3, UnitQuaternion
    robot = rtb.DHRobot([rtb.RevoluteDH(a=a, d=d, alpha=alpha, offset=offset)
                         for a, d, alpha, offset in task['links']],
                        base=SE3(np.array(task['T_root_0'])))
    Q = np.array(task['Q'])
    few = Q[:_COMPARED]

    def one() -> None:
        for q in few:
            UnitQuaternion(robot.fkine(q))

    def many() -> None:
        robot.fkine(Q)
    return {'version': version('roboticstoolbox-python'),
            'poses': [robot.fkine(q).A.tolist() for q in few],
            'one': readings_us(one, len(few), task['seconds']),
            'many': readings_us(many, len(Q), task['seconds'])}


PEERS = {peer.__name__: peer for peer in (pinocchio, pykdl, roboticstoolbox)}

if __name__ == '__main__':
    print(json.dumps(PEERS[sys.argv[1]](json.load(sys.stdin))))
