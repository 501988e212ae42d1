"""What is to be published and how: a valid set of the values that node and `leg_fk bag` take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from icub_leg_fk.errors import LegFKError, ParameterError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, Chain

LEGS = ('left_leg', 'right_leg')
DEFAULT_FRAME = 'dh'
DEFAULT_TIMEOUT = 0.5  # s
LONGEST_TIMEOUT = 1e6  # s
STAMP_SOURCES = ('message', 'now')


@dataclass(frozen=True)
class Configuration:
    """A valid set of values.

    Attributes:
        chains: the chains to publish, in the foot frame asked for.
        notes: what a user should know of this choice, one line each.
        warnings: what is doubtful in the kinematics file, one line each.
        frame_prefix: put before every frame id.
        joint_timeout: greatest age of a joint beside the newest of its chain [s]; 0 is none.
        stamp_now: whether poses are stamped with the present time instead of the message's.
        publish_tf: whether transforms are sent.
        publish_twist: whether twists are sent.
        publish_markers: whether skeletons are sent.
    """

    chains: tuple[Chain, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    frame_prefix: str
    joint_timeout: float
    stamp_now: bool
    publish_tf: bool
    publish_twist: bool
    publish_markers: bool

    @classmethod
    def checked(cls, catalog: Catalog, *, chains: Sequence[str] | None = LEGS, version: str = '',
                foot_frame: str = DEFAULT_FRAME, frame_prefix: str = '',
                joint_timeout: float = DEFAULT_TIMEOUT, stamp_source: str = STAMP_SOURCES[0],
                publish_tf: bool = False, publish_twist: bool = False,
                publish_markers: bool = False) -> Configuration:
        """Return the configuration of some values, which are those of the node's parameters.

        Raises:
            ParameterError: a value cannot be used; names the parameter, what was found and what
                is allowed.
        """
        selected = _select(catalog, chains or (), version)
        _check_choice('stamp_source', stamp_source, STAMP_SOURCES)
        if not 0.0 <= joint_timeout <= LONGEST_TIMEOUT:
            raise ParameterError('joint_timeout', f'found {joint_timeout}, allowed: 0 to '
                                 f'{LONGEST_TIMEOUT:g} s, 0 is none')
        if not frame_prefix.isprintable() or ' ' in frame_prefix or frame_prefix.startswith('/'):
            raise ParameterError('frame_prefix', f'found {frame_prefix!r}, allowed: printable '
                                 'characters other than space, and no leading slash, which tf2 '
                                 'cannot look up')
        framed, notes = _in_frame(selected, foot_frame, frame_prefix)
        return cls(
            chains=framed,
            notes=notes,
            warnings=catalog.warnings,
            frame_prefix=frame_prefix,
            joint_timeout=joint_timeout,
            stamp_now=stamp_source == 'now',
            publish_tf=publish_tf,
            publish_twist=publish_twist,
            publish_markers=publish_markers)


def _select(catalog: Catalog, names: Sequence[str], version: str) -> tuple[Chain, ...]:
    try:
        return catalog.select(names, version)
    except UnknownNameError as error:
        parameter = 'version' if error.name == version else 'chains'
        raise ParameterError(parameter, str(error)) from error
    except LegFKError as error:
        raise ParameterError('chains', str(error)) from error


def _in_frame(chains: Sequence[Chain], frame: str, prefix: str
              ) -> tuple[tuple[Chain, ...], tuple[str, ...]]:
    """Return the chains in a tip frame, and a note on each that lacks it."""
    known = dict.fromkeys(name for chain in chains for name in chain.tip_frames)
    if frame != DEFAULT_FRAME:  # which stands for a chain's first, too
        _check_choice('foot_frame', frame, tuple(known))
    framed, notes = [], []
    for chain in chains:
        if frame in chain.tip_frames:
            framed.append(chain.with_frame(frame))
        else:
            framed.append(chain)
            notes.append(f'{chain.name} has no {frame} frame; its pose is that of '
                         f'{prefix}{chain.frame_id}')
    return tuple(framed), tuple(notes)


def _check_choice(parameter: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ParameterError(parameter, f'found {value!r}, allowed: {" or ".join(choices)}')
