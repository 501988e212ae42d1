"""ROS-free kinematics: DH links, chains, rotations and the catalog of tables.

Transforms are `T_a_b`, taking coordinates in b to coordinates in a; lengths are metres, angles
radians, quaternions (x, y, z, w).
"""

from icub_leg_fk.kinematics.catalog import Catalog, config_file, load_chain
from icub_leg_fk.kinematics.chain import Chain, Row, TipFrame
from icub_leg_fk.kinematics.kinematics_file import ChainEntry
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import matrix_to_quaternion
from icub_leg_fk.kinematics.solver import Pose, Twist
from icub_leg_fk.kinematics.table_from_urdf import chain_from_urdf
from icub_leg_fk.kinematics.urdf_file import Urdf

__all__ = [
    'Catalog',
    'Chain',
    'ChainEntry',
    'DHLink',
    'Pose',
    'Row',
    'TipFrame',
    'Twist',
    'Urdf',
    'chain_from_urdf',
    'config_file',
    'load_chain',
    'matrix_to_quaternion',
]
