"""What the node's parameters amount to: chains to publish and how; free of rclpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from icub_leg_fk.errors import LegFKError, ParameterError
from icub_leg_fk.kinematics import Catalog, Chain

SOLE = 'sole'
# What the balancing controllers take an iCub's foot to be, in its sole frame [m]
# (robotology-legacy/WBI-Toolbox-controllers, iCubGenova04: gain.footSize).
_HEEL, _TOE, _HALF_WIDTH = -0.07, 0.12, 0.04
SOLE_OUTLINE = (
    (_HEEL, _HALF_WIDTH, 0.0), (_TOE, _HALF_WIDTH, 0.0), (_TOE, -_HALF_WIDTH, 0.0),
    (_HEEL, -_HALF_WIDTH, 0.0), (_HEEL, _HALF_WIDTH, 0.0))
STAMP_SOURCES = ('message', 'now')
DEFAULT_FRAME = 'dh'
DEFAULT_TIMEOUT = 0.5  # s
LONGEST_TIMEOUT = 1e6  # s


@dataclass(frozen=True)
class Configuration:
    """A valid set of parameters.

    Attributes:
        chains: the chains to publish, in the foot frame asked for.
        soles: the same chains down to their soles; None for one that has no sole frame.
        notes: what a user should know of this choice, one line each.
        warnings: what is doubtful in the kinematics file, one line each.
        frame_prefix: put before every frame id.
        joint_timeout: greatest age of a joint beside the newest of its chain [s]; 0 is none.
        stamp_now: whether poses are stamped with the node's time instead of the message's.
        publish_tf: whether transforms are broadcast.
        publish_twist: whether twists are published.
        publish_markers: whether skeletons are published.
    """

    chains: tuple[Chain, ...]
    soles: tuple[Chain | None, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    frame_prefix: str
    joint_timeout: float
    stamp_now: bool
    publish_tf: bool
    publish_twist: bool
    publish_markers: bool

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], catalog: Catalog) -> Configuration:
        """Check the values of all parameters together.

        Args:
            values: parameter values by name, in their declared types.
            catalog: the catalog that `kinematics_file` names.

        Raises:
            ParameterError: a value cannot be used; names the parameter, what was found and what
                is allowed.
        """
        names = values['chains']
        if not names or len(set(names)) != len(names):
            raise ParameterError(f'parameter chains: found {list(names or ())}, allowed: one or '
                                 f'more of {", ".join(catalog.chains)}, each once')
        known = {frame: None for entry in catalog.chains.values()
                 for version in entry.versions.values() for frame in version.tip_frames}
        if values['foot_frame'] != DEFAULT_FRAME:  # which stands for the first, too
            _check_choice('foot_frame', values['foot_frame'], tuple(known))
        _check_choice('stamp_source', values['stamp_source'], STAMP_SOURCES)
        timeout, prefix = values['joint_timeout'], values['frame_prefix']
        if not 0.0 <= timeout <= LONGEST_TIMEOUT:
            raise ParameterError(f'parameter joint_timeout: found {timeout}, '
                                 f'allowed: 0 to {LONGEST_TIMEOUT:g} s, 0 is none')
        if not prefix.isprintable() or ' ' in prefix or prefix.startswith('/'):
            raise ParameterError(f'parameter frame_prefix: found {prefix!r}, allowed: printable '
                                 'characters other than space, and no leading slash, which tf2 '
                                 'cannot look up')
        if values['publish_tf'] and find_spec('tf2_msgs') is None:
            raise ParameterError('parameter publish_tf: found true without the Python module '
                                 'tf2_msgs; allowed: false, or install tf2_msgs, which ROS 2 has')
        for name, entry in catalog.chains.items():
            if own := values.get(version_parameter(name)):
                _check_choice(version_parameter(name), own, tuple(entry.versions))
        chains = tuple(_chain(name, values, catalog) for name in names)
        return cls(
            chains=chains,
            soles=tuple(
                catalog.chain(chain.name, chain.version, SOLE)
                if SOLE in _tip_frames(catalog, chain.name, chain.version) else None
                for chain in chains),
            notes=tuple(f'{chain.name} has no {values["foot_frame"]} frame; its pose is that of '
                        f'{prefix}{chain.tip_frame}' for chain in chains if values['foot_frame']
                        not in _tip_frames(catalog, chain.name, chain.version)),
            warnings=catalog.warnings,
            frame_prefix=prefix,
            joint_timeout=timeout,
            stamp_now=values['stamp_source'] == 'now',
            publish_tf=values['publish_tf'],
            publish_twist=values['publish_twist'],
            publish_markers=values['publish_markers'],
        )


def version_parameter(chain: str) -> str:
    """Return the name of the parameter that holds a chain's own version."""
    return f'{chain}.version'


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ParameterError(
            f'parameter {name}: found {value!r}, allowed: {" or ".join(choices)}')


def _chain(name: str, values: Mapping[str, Any], catalog: Catalog) -> Chain:
    parameter, own = 'chains', version_parameter(name)
    try:
        catalog.entry(name)
        parameter = 'version'
        version = values.get(own) or values['version']
        chain = catalog.chain(name, version)
        if values['foot_frame'] in _tip_frames(catalog, name, version):
            chain = catalog.chain(name, version, values['foot_frame'])
        return chain
    except LegFKError as error:
        hint = f' (or set {own})' if parameter == 'version' else ''
        raise ParameterError(f'parameter {parameter}: {error}{hint}') from error


def _tip_frames(catalog: Catalog, chain: str, version: str) -> tuple[str, ...]:
    return tuple(catalog.entry(chain).versions[version].tip_frames)
