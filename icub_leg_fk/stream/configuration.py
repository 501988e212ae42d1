"""What is to be published and how: a valid set of the values that node and `leg_fk bag` take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from icub_leg_fk.errors import (
    LegFKError,
    ParameterError,
    UnknownNameError,
    VersionNeededError,
)
from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.kinematics.table_from_urdf import VERSION

LEGS = ('left_leg', 'right_leg')
DEFAULT_FRAME = 'dh'
DEFAULT_TIMEOUT = 0.5  # s
LONGEST_TIMEOUT = 1e6  # s
STAMP_SOURCES = ('message', 'now')


@dataclass(frozen=True)
class Configuration:
    """A valid set of values.

    Attributes:
        chains: the chains to publish, in the foot frame asked for, their joints under the names
            that are looked for; none as long as a description is waited for.
        awaited: names of the chains that wait for a description of the robot.
        notes: what a user should know of this choice, one line each.
        warnings: what is doubtful in the kinematics file, one line each.
        joint_prefix: put before every joint name that is looked for.
        frame_prefix: put before every frame id.
        joint_timeout: how far a joint may lag the newest of its chain [s]; 0 is no limit.
        stamp_now: whether poses are stamped with the present time instead of the message's.
        publish_tf: whether the poses are sent as transforms, too.
        publish_twist: whether the velocities of the tips are sent, too.
        publish_markers: whether the skeletons are sent, too.
    """

    chains: tuple[Chain, ...]
    awaited: tuple[str, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    joint_prefix: str
    frame_prefix: str
    joint_timeout: float
    stamp_now: bool
    publish_tf: bool
    publish_twist: bool
    publish_markers: bool

    @classmethod
    def checked(
        cls,
        catalog: Catalog | None,
        *,
        chains: Sequence[str] = LEGS,
        version: str = '',
        joint_prefix: str = '',
        foot_frame: str = DEFAULT_FRAME,
        frame_prefix: str = '',
        joint_timeout: float = DEFAULT_TIMEOUT,
        stamp_source: str = STAMP_SOURCES[0],
        publish_tf: bool = False,
        publish_twist: bool = False,
        publish_markers: bool = False,
    ) -> Configuration:
        """Return the configuration of some values, which are those of the node's parameters.

        `version` is that of every chain which is named without one, their defaults if empty. A
        chain that has one frame only gives that, whatever `foot_frame` is; `dh` also stands for
        the first frame of a chain that has none of this name. Without a catalog the chains wait
        for that of the robot's description.

        Raises:
            ParameterError: a value cannot be used; names the parameter, what was found and what
                is allowed.
        """
        _check_choice('stamp_source', stamp_source, STAMP_SOURCES)
        _check_timeout(joint_timeout)
        _check_frame_prefix(frame_prefix)
        _check_joint_prefix(joint_prefix)
        framed: tuple[Chain, ...] = ()
        if catalog is None:
            _check_awaited(chains, version)
        else:
            selected = _selected(catalog, chains, version)
            framed = tuple(_in_frame(chain, foot_frame) for chain in selected)
            _refuse_shared_topics(framed)
        return cls(
            chains=tuple(_with_prefix(chain, joint_prefix) for chain in framed),
            awaited=() if framed else tuple(chains),
            notes=_notes(framed, foot_frame, frame_prefix),
            warnings=catalog.warnings if catalog else (),
            joint_prefix=joint_prefix,
            frame_prefix=frame_prefix,
            joint_timeout=joint_timeout,
            stamp_now=stamp_source == 'now',
            publish_tf=publish_tf,
            publish_twist=publish_twist,
            publish_markers=publish_markers,
        )


def _selected(
    catalog: Catalog, names: Sequence[str], version: str
) -> tuple[Chain, ...]:
    try:
        return catalog.select(names, version)
    except VersionNeededError as error:
        raise ParameterError('version', str(error)) from error
    except UnknownNameError as error:
        parameter = 'version' if error.name == version else 'chains'
        raise ParameterError(parameter, str(error)) from error
    except LegFKError as error:
        raise ParameterError('chains', str(error)) from error


def _check_awaited(chains: Sequence[str], version: str) -> None:
    """Refuse what no description can make good."""
    if version not in ('', VERSION):
        raise ParameterError(
            'version',
            f'found {version!r}, allowed with description_from_topic: '
            f'none, or {VERSION}',
        )
    if not chains:
        raise ParameterError('chains', 'no chain is named; allowed: one or more')


def _refuse_shared_topics(chains: Sequence[Chain]) -> None:
    first_of: dict[str, str] = {}
    for chain in chains:
        first = first_of.setdefault(chain.tip, chain.name)
        if first != chain.name:
            raise ParameterError(
                'chains',
                f'{first} and {chain.name} have the same tip, '
                f'{chain.tip}, and so the same topics',
            )


def _with_prefix(chain: Chain, prefix: str) -> Chain:
    """Return a chain whose joints have a prefix."""
    if not prefix:
        return chain
    links = []
    for link in chain.links:
        joint = prefix + link.joint if link.joint else ''
        links.append(replace(link, joint=joint))
    names = tuple(prefix + name for name in chain.joint_names)
    return replace(chain, joint_names=names, links=tuple(links))


def _in_frame(chain: Chain, frame: str) -> Chain:
    """Return a chain in a frame of its tip; in the only one, or the first for `dh`, if it must."""
    if frame in chain.tip_frames:
        return chain.with_frame(frame)
    if len(chain.tip_frames) > 1 and frame != DEFAULT_FRAME:
        _check_choice('foot_frame', frame, tuple(chain.tip_frames))
    return chain


def _notes(chains: Sequence[Chain], frame: str, prefix: str) -> tuple[str, ...]:
    """Return a line on each chain that has no frame of this name."""
    without = [chain for chain in chains if chain.frame != frame]
    return tuple(
        f'{chain.name} has no {frame} frame; its pose is that of '
        f'{prefix}{chain.frame_id}'
        for chain in without
    )


def _check_choice(parameter: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ParameterError(
            parameter, f'found {value!r}, allowed: {" or ".join(choices)}'
        )


def _check_timeout(seconds: float) -> None:
    if not 0.0 <= seconds <= LONGEST_TIMEOUT:  # so written, NaN is refused, too
        raise ParameterError(
            'joint_timeout',
            f'found {seconds}, allowed: 0 to {LONGEST_TIMEOUT:g} s; 0 turns it off',
        )


def _check_joint_prefix(prefix: str) -> None:
    if not prefix.isprintable():
        raise ParameterError(
            'joint_prefix', f'found {prefix!r}, allowed: printable characters'
        )


def _check_frame_prefix(prefix: str) -> None:
    is_text = prefix.isprintable() and ' ' not in prefix
    if not is_text or prefix.startswith('/'):
        raise ParameterError(
            'frame_prefix',
            f'found {prefix!r}, allowed: printable characters '
            'other than space, and no leading slash, which tf2 cannot look up',
        )
