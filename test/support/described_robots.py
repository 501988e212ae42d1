"""Robots by their descriptions, and where Pinocchio finds the feet of them."""

from functools import cache

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.tools.urdf_text import urdf_text
import numpy as np
import pytest
from support.recorded_walk import SHARED

REAL = {file.stem: file for file in sorted((SHARED / 'urdf').glob('*.urdf'))}

needs_real_robots = pytest.mark.skipif(not REAL, reason=f'no URDF in {SHARED / "urdf"}')


@cache
def own_description(version, *chains):
    """Return the description of a robot that is exactly as the tables of a version."""
    names = chains or ('left_leg', 'right_leg')
    return urdf_text(f'robot_{version}', Catalog.load().select(names, version))


@cache
def _model(text):
    pin = pytest.importorskip('pinocchio', reason='Pinocchio is not installed')
    model = pin.buildModelFromXML(text, mimic=True)
    return pin, model, model.createData()


def pinocchio_pose(text, root, tip, positions):
    """Return T_root_tip as Pinocchio has it, from a description and positions by joint [rad]."""
    pin, model, data = _model(text)
    q = pin.neutral(model)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        # A joint without limits is a point on the circle there.
        turned = [np.cos(value), np.sin(value)] if joint.nq == 2 else value
        q[joint.idx_q : joint.idx_q + joint.nq] = turned
    pin.framesForwardKinematics(model, data, q)
    T_root, T_tip = [
        data.oMf[model.getFrameId(link, pin.FrameType.BODY)] for link in (root, tip)
    ]
    return np.array((T_root.inverse() * T_tip).homogeneous)
