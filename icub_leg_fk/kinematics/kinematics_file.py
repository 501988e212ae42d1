"""Reading a kinematics file: YAML that looks like the printed tables, in their units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import TypeVar

from icub_leg_fk.kinematics.chain import Chain, TipFrame
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.link import CONVENTIONS, DHLink, JOINT_TYPES, standard_rows
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.yaml_fields import Field, FRAME_ID, read_yaml, WORD
import numpy as np

_Value = TypeVar('_Value')
_Default = TypeVar('_Default')

_LENGTHS = ('mm', 'm')
_ANGLES = ('deg', 'rad')
DIRECTIONS = {
    'forward': (1, 0, 0),
    'backward': (-1, 0, 0),
    'left': (0, 1, 0),
    'right': (0, -1, 0),
    'up': (0, 0, 1),
    'down': (0, 0, -1),
}
_LONGEST = 1e9  # m; what is larger leaves no room to compute with
_UNLIKELY = 10.0  # m
_LIKELY = 0.005  # m; some length of a robot in mm is longer
_ROUGHLY = 1e-4  # rad
_QUARTERS = {1: 'pi/2', 2: 'pi', 3: '3*pi/2', 4: '2*pi'}
_NO_RANGE = (-math.inf, math.inf)
_FOUR_DECIMALS = 2e-4  # what rounding to four decimals may do to R R^T
_EXACT = 1e-9  # below it a rotation was written with all its digits
_MOST_ROWS = 10_000  # aliases can make a small file say very much

_PLACE = ('root_frame', 'joints', 'tip_frames')
_REPLACEABLE = (*_PLACE, 'root_axes')
_VERSION = ('T_Ro0', 'T_nIs', 'convention', 'source', *_REPLACEABLE)
_ROW = ('offset', 'range', 'robot_range', 'type', 'gain', 'joint', 'erratum')
_OF_A_JOINT = ('range', 'robot_range', 'gain', 'joint')
_OTHER_NAMES = {'sign': 'gain', 'theta': 'offset'}  # what people write for a row's keys


@dataclass(frozen=True, eq=False, repr=False)
class ChainEntry(Frozen):
    """A chain of the file: what its tip is, and its versions.

    Attributes:
        name: name of the chain.
        tip: what is at its end; names the topics.
        versions: the chain in each version, by the version's name.
        default_version: the one that counts where none is given; empty if one must be.
    """

    name: str
    tip: str
    versions: Mapping[str, Chain]
    default_version: str = ''

    def __repr__(self) -> str:
        return f'<ChainEntry {self.name[:40]}: {listed(self.versions)}>'


def read_kinematics_file(
    path: str | Path,
) -> tuple[str, dict[str, ChainEntry], tuple[str, ...]]:
    """Return the path, the chains by name, and what is doubtful in the file, one line each.

    Raises:
        CatalogError: the file cannot be read or has a mistake.
    """
    reader = _FileReader()
    file, chains = reader.chains(path)
    return file, chains, tuple(dict.fromkeys(reader.warnings))


def listed(names: Iterable[str]) -> str:
    """Return names as a list that is short enough for a line."""
    shown = ', '.join(names)
    return shown if len(shown) <= 60 else f'{shown[:57]}...'


class _FileReader:
    """Reads one kinematics file; units and warnings are known on the way."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self._length = self._angle = ''
        self._rows_read = 0

    def chains(self, path: str | Path) -> tuple[str, dict[str, ChainEntry]]:
        root = read_yaml(path)
        top = root.record(('units', 'chains'), ('default_version',))
        units = top['units'].record(('length', 'angle'))
        self._length = units['length'].choice(_LENGTHS)
        self._angle = units['angle'].choice(_ANGLES)
        chains = top['chains'].mapping('chains by name', lambda name: f'chain {name}')
        if not chains:
            top['chains'].fail('at least one chain', 'none')
        entries = {name: self._entry(name, at, top) for name, at in chains.items()}
        self._check_tips(entries, chains)
        self._check_default(top, entries)
        return root.file, entries

    def _entry(self, name: str, at: Field, top: Mapping[str, Field]) -> ChainEntry:
        fields = at.record(
            ('tip', *_PLACE, 'versions'), ('root_axes', 'default_version')
        )
        tip = fields['tip'].name('a name', WORD)
        versions = self._versions(name, tip, fields)
        return ChainEntry(
            name, tip, versions, self._default_version(versions, fields, top)
        )

    def _check_tips(
        self, entries: Mapping[str, ChainEntry], chains: Mapping[str, Field]
    ) -> None:
        owners: dict[str, str] = {}
        for name, entry in entries.items():
            owner = owners.setdefault(entry.tip, name)
            if owner != name:
                tip = chains[name].at('field tip')
                tip.fail(
                    'another tip for each chain',
                    f'{entry.tip}, the tip of chain {owner}',
                )

    def _check_default(
        self, top: Mapping[str, Field], entries: Mapping[str, ChainEntry]
    ) -> None:
        """Refuse a default version that no chain has."""
        if 'default_version' not in top:
            return
        default = top['default_version'].name('a version')
        known = dict.fromkeys(
            version for entry in entries.values() for version in entry.versions
        )
        if default not in known:
            top['default_version'].fail(f'a version of the file: {", ".join(known)}')

    def _default_version(
        self,
        versions: Mapping[str, Chain],
        chain: Mapping[str, Field],
        top: Mapping[str, Field],
    ) -> str:
        """Return the chain's own default, or the file's, or the only version; else nothing."""
        if 'default_version' in chain:
            return chain['default_version'].choice(tuple(versions))
        default = _given(top, 'default_version', lambda at: at.name('a version'), '')
        if default in versions:
            return default
        return next(iter(versions)) if len(versions) == 1 else ''

    def _versions(
        self, name: str, tip: str, chain: Mapping[str, Field]
    ) -> dict[str, Chain]:
        versions = chain['versions'].mapping(
            'versions by name', lambda version: f'chain {name}, version {version}'
        )
        if not versions:
            chain['versions'].fail('at least one version', 'none')
        return {
            version: self._version(name, tip, version, at, chain)
            for version, at in versions.items()
        }

    def _version(
        self, name: str, tip: str, version: str, at: Field, chain: Mapping[str, Field]
    ) -> Chain:
        if at.has('virtual_link'):
            at.fail(
                'a last row of links instead, such as '
                '{a: 0, d: 6.6, alpha: 90, offset: 0, type: fixed}',
                'key virtual_link',
            )
        own = at.record(('links',), _VERSION)
        place = {**chain, **own}
        convention = _given(
            own, 'convention', lambda at: at.choice(CONVENTIONS), 'standard'
        )
        root_frame = place['root_frame'].name('a frame id', FRAME_ID)
        joint_names = self._joint_names(place['joints'])
        links = self._links(Field(at.file, at.where, own['links'].node), joint_names)
        T_root_0 = _given(own, 'T_Ro0', self._transform, np.eye(4))
        self._doubt_lengths(at, links, T_root_0)
        return Chain(
            name=name,
            version=version,
            root_frame=root_frame,
            tip=tip,
            joint_names=joint_names,
            links=standard_rows(links) if convention == 'modified' else tuple(links),
            T_root_0=T_root_0,
            tip_frames=self._tip_frames(place['tip_frames'], root_frame),
            T_n_tip=_given(own, 'T_nIs', self._transform, np.eye(4)),
            convention=convention,
            root_axes=_given(place, 'root_axes', self._root_axes, ()),
            source=_given(own, 'source', Field.text, ''),
        )

    def _joint_names(self, at: Field) -> tuple[str, ...]:
        joints: list[str] = []
        for item in at.items('a list of joint names'):
            joint = item.name('a joint name')
            if joint in joints:
                item.fail('each joint once', f'joint {joint} again')
            joints.append(joint)
        return tuple(joints)

    def _root_axes(self, at: Field) -> tuple[str, ...]:
        """Return where x, y and z of the root point."""
        words = tuple(
            item.choice(tuple(DIRECTIONS)) for item in at.items('three directions', 3)
        )
        x, y, z = (DIRECTIONS[word] for word in words)
        if not np.array_equal(np.cross(x, y), z):
            at.fail(
                'directions of x, y, z that make a right-handed frame', ', '.join(words)
            )
        return words

    def _tip_frames(self, at: Field, root_frame: str) -> dict[str, TipFrame]:
        frames = {}
        named = at.mapping(
            'tip frames by name', lambda name: f'{at.where}, {name}', WORD
        )
        for name, value in named.items():
            fields = value.record(('frame',), ('transform', 'outline'))
            frame_id = fields['frame'].name('a frame id', FRAME_ID)
            if frame_id == root_frame:
                fields['frame'].fail('another frame id than the root frame')
            frames[name] = TipFrame(
                frame_id,
                _given(fields, 'transform', self._transform, np.eye(4)),
                _given(fields, 'outline', self._outline, None),
            )
        if not frames:
            at.fail('at least one tip frame', 'none')
        return frames

    def _outline(self, at: Field) -> Array:
        """Return the (K, 2) corners of a sole [m]."""
        corners = []
        for corner in at.items('a list of corners [x, y]'):
            x, y = corner.items('[x, y]', 2)
            corners.append([self._metres(x), self._metres(y)])
        if len(corners) < 3:
            at.fail('at least three corners', f'{len(corners)}')
        return np.array(corners)

    def _links(self, at: Field, joint_names: Sequence[str]) -> list[DHLink]:
        links = []
        has_range: set[str] = set()
        rows = at.at('field links').items('a list of rows')
        for index, item in enumerate(rows):
            row = Field(at.file, f'{at.where}, row {index}', item.node)
            self._rows_read += 1
            if self._rows_read > _MOST_ROWS:
                at.fail(f'at most {_MOST_ROWS} in a file', 'too many rows')
            links.append(self._link(row, joint_names, has_range))
        named = {link.joint for link in links if link.joint}
        unnamed_rows = sum(not link.is_fixed and not link.joint for link in links)
        unnamed_joints = sum(name not in named for name in joint_names)
        if unnamed_rows != unnamed_joints:
            at.at('field links').fail(
                f'{unnamed_joints}, one per joint that no row names',
                f'{unnamed_rows} row{"s" * (unnamed_rows != 1)} with a joint',
            )
        return links

    def _link(
        self, row: Field, joint_names: Sequence[str], has_range: set[str]
    ) -> DHLink:
        for other, name in _OTHER_NAMES.items():
            if row.has(other):
                row.fail(f'{name} instead', f'key {other}')
        fields = row.record(('a', 'd', 'alpha'), _ROW)
        joint_type = _given(
            fields, 'type', lambda at: at.choice(JOINT_TYPES), 'revolute'
        )
        for name in _OF_A_JOINT:
            if joint_type == 'fixed' and name in fields:
                fields[name].fail('nothing, since a fixed row has no joint')
        joint = _given(fields, 'joint', lambda at: at.choice(tuple(joint_names)), '')
        self._check_follower(fields, joint, has_range)
        slides = joint_type == 'prismatic'
        lower, upper = _given(
            fields, 'range', lambda at: self._range(at, slides), _NO_RANGE
        )
        return DHLink(
            a=self._metres(fields['a']),
            d=self._metres(fields['d']),
            alpha=self._row_angle(fields['alpha']),
            offset=_given(fields, 'offset', self._row_angle, 0.0),
            joint_type=joint_type,
            gain=_given(fields, 'gain', self._gain, 1.0),
            joint=joint,
            lower=lower,
            upper=upper,
            robot_range=_given(
                fields, 'robot_range', lambda at: self._range(at, slides), None
            ),
            erratum=_given(fields, 'erratum', Field.text, ''),
        )

    def _check_follower(
        self, fields: Mapping[str, Field], joint: str, seen: set[str]
    ) -> None:
        """Refuse a range on another row than the first that its joint moves."""
        if not joint:
            return
        if joint in seen:
            for name in ('range', 'robot_range'):
                if name in fields:
                    fields[name].fail(
                        f'nothing: the range of joint {joint} stands on the first '
                        'row that it moves'
                    )
        seen.add(joint)

    def _gain(self, at: Field) -> float:
        gain = at.number()
        if gain == 0.0:
            at.fail('a number other than 0')
        return gain

    def _range(self, at: Field, slides: bool) -> tuple[float, float]:
        limits = list(at.items('[lower, upper]', 2))
        convert = self._metres if slides else self._radians
        lower, upper = (convert(limit) for limit in limits)
        if lower > upper:
            at.fail(
                'lower at most upper', ' above '.join(limit.found() for limit in limits)
            )
        return lower, upper

    def _metres(self, at: Field) -> float:
        # Dividing, unlike multiplying by 1e-3, gives the float nearest to the printed value.
        value = at.number(self._length)
        length = value / 1000.0 if self._length == 'mm' else value
        if abs(length) > _LONGEST:
            at.fail(f'a length up to {_LONGEST:g} m')
        if abs(length) > _UNLIKELY:
            self._warn(
                at, f'{length:g} m is unlikely; the unit of length is {self._length}'
            )
        return length

    def _radians(self, at: Field) -> float:
        angle = at.fraction_of_pi()
        if angle is not None:
            return angle
        value = at.number(f'{self._angle}, or as in pi/2')
        if self._angle == 'deg':
            if _is_rounded_fraction_of_pi(at.node.value):
                self._warn(
                    at,
                    f'{value:g} deg is unlikely, since it is a fraction of pi; the '
                    'unit of angle is deg',
                )
            return math.radians(value)
        if abs(value) > 2 * math.pi + 1e-3:
            self._warn(at, f'{value:g} rad is unlikely; the unit of angle is rad')
        return value

    def _row_angle(self, at: Field) -> float:
        """Return alpha or offset [rad]; a right angle of few decimals is doubtful."""
        angle = self._radians(at)
        quarters = round(abs(angle) / (math.pi / 2))
        error = abs(abs(angle) - quarters * math.pi / 2)
        is_rounded = self._angle == 'rad' and _is_rounded_fraction_of_pi(at.node.value)
        if quarters in _QUARTERS and is_rounded and error > _ROUGHLY:
            sign = '-' if angle < 0 else ''
            self._warn(
                at,
                f'{angle:g} rad is {error:.1g} rad from {sign}{_QUARTERS[quarters]}, '
                'which can be written so',
            )
        return angle

    def _doubt_lengths(
        self, at: Field, links: Sequence[DHLink], T_root_0: Array
    ) -> None:
        """Warn of metres in a table of millimetres."""
        lengths = [abs(length) for link in links for length in (link.a, link.d)]
        longest = max(*lengths, *np.abs(T_root_0[:3, 3]).tolist())
        if self._length == 'mm' and 0.0 < longest < _LIKELY:
            self._warn(
                at,
                f'{1000 * longest:g} mm for the longest length is unlikely; the unit '
                'of length is mm',
            )

    def _transform(self, at: Field) -> Array:
        T = np.eye(4)
        for i, row in enumerate(at.items('4 rows of 4 numbers', 4)):
            for j, number in enumerate(
                row.at(f'row {i}').items('a row of 4 numbers', 4)
            ):
                entry = number.at(f'column {j}')
                is_length = i < 3 and j == 3
                T[i, j] = self._metres(entry) if is_length else entry.number()
        if not is_rigid_transform(T, _FOUR_DECIMALS):
            at.fail(
                'a rotation (to four decimals at least), a translation and the last row '
                '0 0 0 1',
                'a matrix that is not a rigid transform',
            )
        mended = nearest_rotation(T[:3, :3])
        change = float(np.abs(mended - T[:3, :3]).max())
        if change > _EXACT:
            self._warn(
                at,
                f'the rotation is rounded; corrected by up to {change:.1g} per entry',
            )
        T[:3, :3] = mended
        return T

    def _warn(self, at: Field, text: str) -> None:
        self.warnings.append(f'{at.file}:{at.line}: {at.where}: {text}')


def _is_rounded_fraction_of_pi(text: str) -> bool:
    """Return whether a number is pi/12, or a few times that, as people round radians."""
    if 'pi' in text:
        return False
    decimals = len(text.partition('.')[2])
    part = math.pi / 2 if decimals == 2 else math.pi / 12
    times = round(float(text) / part)
    if not 2 <= decimals <= 8 or not 0 < abs(times) * part < 6.3:
        return False
    return round(times * part, decimals) == float(text)


def _given(
    fields: Mapping[str, Field],
    name: str,
    read: Callable[[Field], _Value],
    default: _Default,
) -> _Value | _Default:
    """Return what an optional field holds, or a default."""
    return read(fields[name]) if name in fields else default
