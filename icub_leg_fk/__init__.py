"""Forward kinematics of the iCub's legs, and of any Denavit-Hartenberg table."""

from importlib import import_module
from typing import Any, TYPE_CHECKING

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
)

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Catalog, Chain, DHLink, load_chain

__version__ = '0.1.0'

_KINEMATICS = ('Catalog', 'Chain', 'DHLink', 'load_chain')

__all__ = [
    'Catalog', 'CatalogError', 'Chain', 'DHLink', 'InputFileError', 'JointVectorError',
    'LegFKError', 'MalformedMessageError', 'MissingDependencyError', 'OutputFileError',
    'ParameterError', 'UnknownNameError', 'load_chain',
]


def __getattr__(name: str) -> Any:
    """Import numpy only when it is needed, which it is not for `leg_fk -h`."""
    if name in _KINEMATICS:
        return getattr(import_module('icub_leg_fk.kinematics'), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
