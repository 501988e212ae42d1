"""Reading a kinematics file: YAML that looks like the printed tables, in their units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path

from icub_leg_fk.kinematics.chain import Chain, TipFrame
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.link import CONVENTIONS, DHLink, JOINT_TYPES, standard_rows
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.yaml_fields import (
    Field,
    FRAME_ID,
    LINE,
    read_yaml,
    Record,
    WORD,
)
import numpy as np

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
_IN_A_ROW = {'sign': 'gain', 'theta': 'offset'}  # what people write, and what is meant
_IN_A_VERSION = {
    'virtual_link': 'a last row such as {a: 0, d: 6.6, alpha: 90, type: fixed}'
}


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
        self._length = self._angle = self._default = ''
        self._rows_read = 0
        self._owners: dict[str, str] = {}  # of the tips

    def chains(self, path: str | Path) -> tuple[str, dict[str, ChainEntry]]:
        root = read_yaml(path)
        top = root.record(('units', 'chains'), ('default_version',))
        units = top['units'].record(('length', 'angle'))
        self._length = units['length'].choice(_LENGTHS)
        self._angle = units['angle'].choice(_ANGLES)
        self._default = top.given('default_version', '', Field.name, 'a version')
        chains = top['chains'].mapping(
            'chains by name', lambda name: f'chain {name}', at_least_one='chain'
        )
        entries = {name: self._entry(name, at) for name, at in chains.items()}
        versions = {version for entry in entries.values() for version in entry.versions}
        if self._default and self._default not in versions:
            known = ', '.join(sorted(versions))
            top['default_version'].fail(f'a version of the file: {known}')
        return root.file, entries

    def _entry(self, name: str, at: Field) -> ChainEntry:
        fields = at.record(
            ('tip', *_PLACE, 'versions'), ('root_axes', 'default_version')
        )
        tip = fields['tip'].name('a name', WORD)
        owner = self._owners.setdefault(tip, name)
        if owner != name:
            fields['tip'].fail(
                'another tip for each chain', f'{tip}, the tip of chain {owner}'
            )
        named = fields['versions'].mapping(
            'versions by name',
            lambda version: f'chain {name}, version {version}',
            at_least_one='version',
        )
        versions = {}
        for version, version_at in named.items():
            versions[version] = self._version(name, tip, version, version_at, fields)
        return ChainEntry(name, tip, versions, self._default_version(versions, fields))

    def _default_version(self, versions: Mapping[str, Chain], chain: Record) -> str:
        """Return the chain's own default, or the file's, or the only version; else nothing."""
        own = chain.given('default_version', '', Field.choice, tuple(versions))
        if own or self._default in versions:
            return own or self._default
        return next(iter(versions)) if len(versions) == 1 else ''

    def _version(
        self, name: str, tip: str, version: str, at: Field, chain: Record
    ) -> Chain:
        own = at.record(('links',), _VERSION, _IN_A_VERSION)
        place = Record({**chain, **own})
        convention = own.given('convention', 'standard', Field.choice, CONVENTIONS)
        root_frame = place['root_frame'].name('a frame id', FRAME_ID)
        joint_names = self._joint_names(place['joints'])
        links = self._links(at, own['links'], joint_names)
        T_root_0 = own.given('T_Ro0', np.eye(4), self._transform)
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
            T_n_tip=own.given('T_nIs', np.eye(4), self._transform),
            convention=convention,
            root_axes=place.given('root_axes', (), self._root_axes),
            source=own.given('source', '', Field.name, '', LINE),
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
            'tip frames by name',
            lambda name: f'{at.where}, {name}',
            WORD,
            at_least_one='tip frame',
        )
        for name, value in named.items():
            fields = value.record(('frame',), ('transform', 'outline'))
            frame_id = fields['frame'].name('a frame id', FRAME_ID)
            if frame_id == root_frame:
                fields['frame'].fail('another frame id than the root frame')
            frames[name] = TipFrame(
                frame_id,
                fields.given('transform', np.eye(4), self._transform),
                fields.given('outline', None, self._outline),
            )
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

    def _links(
        self, version: Field, at: Field, joint_names: Sequence[str]
    ) -> list[DHLink]:
        links = []
        has_range: set[str] = set()
        for index, item in enumerate(at.items('a list of rows')):
            self._rows_read += 1
            if self._rows_read > _MOST_ROWS:
                at.fail(f'at most {_MOST_ROWS} in a file', 'too many rows')
            row = Field(at.file, f'{version.where}, row {index}', item.node)
            links.append(self._link(row, joint_names, has_range))
        named = {link.joint for link in links if link.joint}
        unnamed_rows = sum(not link.is_fixed and not link.joint for link in links)
        unnamed_joints = sum(name not in named for name in joint_names)
        if unnamed_rows != unnamed_joints:
            at.fail(
                f'{unnamed_joints}, one per joint that no row names',
                f'{unnamed_rows} row{"s" * (unnamed_rows != 1)} with a joint',
            )
        return links

    def _link(
        self, row: Field, joint_names: Sequence[str], has_range: set[str]
    ) -> DHLink:
        fields = row.record(('a', 'd', 'alpha'), _ROW, _IN_A_ROW)
        joint_type = fields.given('type', 'revolute', Field.choice, JOINT_TYPES)
        joint = fields.given('joint', '', Field.choice, tuple(joint_names))
        for name in _OF_A_JOINT:
            if name in fields and joint_type == 'fixed':
                fields[name].fail('nothing, since a fixed row has no joint')
            if name in fields and name.endswith('range') and joint in has_range:
                fields[name].fail(
                    f'nothing: the range of joint {joint} stands on the first row that it moves'
                )
        if joint:
            has_range.add(joint)
        slides = joint_type == 'prismatic'
        lower, upper = fields.given('range', _NO_RANGE, self._range, slides)
        return DHLink(
            a=self._metres(fields['a']),
            d=self._metres(fields['d']),
            alpha=self._row_angle(fields['alpha']),
            offset=fields.given('offset', 0.0, self._row_angle),
            joint_type=joint_type,
            gain=fields.given('gain', 1.0, self._gain),
            joint=joint,
            lower=lower,
            upper=upper,
            robot_range=fields.given('robot_range', None, self._range, slides),
            erratum=fields.given('erratum', '', Field.name, '', LINE),
        )

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
