"""Forward kinematics of the iCub's legs, and of any Denavit-Hartenberg table."""

from icub_leg_fk.errors import (
    CatalogError,
    InputFileError,
    JointVectorError,
    LegFKError,
    MalformedMessageError,
    MissingDependencyError,
    OutputFileError,
    ParameterError,
    UnknownNameError,
    VersionNeededError,
)
from icub_leg_fk.kinematics import Catalog, Chain, DHLink, load_chain
from icub_leg_fk.tools.add_poses import add_foot_poses

__all__ = [
    'Catalog',
    'CatalogError',
    'Chain',
    'DHLink',
    'InputFileError',
    'JointVectorError',
    'LegFKError',
    'MalformedMessageError',
    'MissingDependencyError',
    'OutputFileError',
    'ParameterError',
    'UnknownNameError',
    'VersionNeededError',
    'add_foot_poses',
    'load_chain',
]

__version__ = '0.1.0'


def __dir__() -> list[str]:
    return __all__
