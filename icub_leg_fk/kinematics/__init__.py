"""ROS-free kinematics: DH links, chains, rotations and the catalog of tables.

Transforms are `T_a_b`, taking coordinates in b to coordinates in a; lengths are metres, angles
radians, quaternions (x, y, z, w).
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

from icub_leg_fk.kinematics.catalog import Catalog, config_file, load_chain
from icub_leg_fk.kinematics.chain import Chain
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import matrix_to_quaternion

if TYPE_CHECKING:
    from icub_leg_fk.kinematics.table_from_urdf import chain_from_urdf
    from icub_leg_fk.kinematics.urdf_file import Urdf

__all__ = [
    'Catalog', 'Chain', 'DHLink', 'Urdf', 'chain_from_urdf', 'config_file', 'load_chain',
    'matrix_to_quaternion',
]


def __getattr__(name: str) -> Any:
    """Import what reads URDFs only when it is needed."""
    modules = {'chain_from_urdf': 'table_from_urdf', 'Urdf': 'urdf_file'}
    if name in modules:
        return getattr(import_module(f'icub_leg_fk.kinematics.{modules[name]}'), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
