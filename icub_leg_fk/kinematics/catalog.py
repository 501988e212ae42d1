"""The catalog: chains and versions by name, from a kinematics file in the units of its tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from pathlib import Path
import sys
import sysconfig
from typing import TypeVar
import warnings

from icub_leg_fk.errors import CatalogError, UnknownNameError
from icub_leg_fk.kinematics.chain import Chain, CONVENTIONS, standard_rows
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.link import DHLink, JOINT_TYPES
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.yaml_fields import Field, FRAME, read_yaml, WORD
import numpy as np

PACKAGE = 'icub_leg_fk'

_Thing = TypeVar('_Thing')
_LENGTHS = ('mm', 'm')
_ANGLES = ('deg', 'rad')
_LONGEST = 1e9  # m; what is larger leaves no room to compute with
_UNLIKELY = 100.0  # m
_FOUR_DECIMALS = 2e-4  # what rounding to four decimals may do to R R^T
_EXACT = 1e-9  # below it a rotation was written with all its digits
_PLACE = ('root_frame', 'joints', 'tip_frames')
_DH = ('a', 'd', 'alpha', 'offset')
_JOINT = ('range', 'robot_range', 'sign')


@dataclass(frozen=True, eq=False)
class TipFrame(Frozen):
    """A frame in which the tip's pose can be given: its frame id and its place on the tip.

    Attributes:
        frame: frame id.
        T_dh_tip: (4, 4) transform from this frame to the end of the table (and its T_nIs).
    """

    frame: str
    T_dh_tip: Array


@dataclass(frozen=True, eq=False)
class ChainVersion(Frozen):
    """One version of a chain; lengths [m], angles [rad].

    Attributes:
        root_frame: frame id of the root.
        joint_names: n joint names, root to tip.
        tip_frames: the frames at the tip by name; the first is the default.
        convention: `standard` or `modified`, as the file has it.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        links: m rows in the standard convention.
        T_n_tip: (4, 4) transform from the end of the tip to the last row's frame.
        source: where the table comes from; empty if nothing is said.
    """

    root_frame: str
    joint_names: tuple[str, ...]
    tip_frames: Mapping[str, TipFrame]
    convention: str
    T_root_0: Array
    links: tuple[DHLink, ...]
    T_n_tip: Array
    source: str


@dataclass(frozen=True, eq=False)
class ChainEntry(Frozen):
    """A chain of the file: what its tip is, which names the topics, and its versions by name."""

    name: str
    tip: str
    versions: Mapping[str, ChainVersion]


@dataclass(frozen=True, eq=False)
class Catalog(Frozen):
    """Every chain of one kinematics file. Two catalogs with the same chains are equal.

    Attributes:
        file: path of the file.
        chains: the entries by name.
        warnings: what can be computed with but can hardly be meant, one line each.
    """

    file: str = field(compare=False)
    chains: Mapping[str, ChainEntry]
    warnings: tuple[str, ...] = field(default=(), compare=False)

    @classmethod
    def load(cls, path: str | Path | None = None) -> Catalog:
        """Read a kinematics file; the shipped one if none is given.

        Raises:
            CatalogError: the file cannot be read or has a mistake; it names file, line, chain,
                version, row and field, what was found and what is allowed.
        """
        file = config_file('icub_kinematics.yaml') if path is None else Path(path)
        return _Reader().catalog(file)

    def entry(self, chain: str) -> ChainEntry:
        """Return a chain with all its versions.

        Raises:
            UnknownNameError: no such chain; lists the known ones.
        """
        return _named('chain', chain, self.chains)

    def chain(self, name: str, version: str, frame: str | None = None) -> Chain:
        """Return one version of one chain, ready to compute with.

        Args:
            name: chain, such as `left_leg`.
            version: version, such as `v2_5`.
            frame: tip frame, such as `sole`; the chain's first if None.

        Raises:
            UnknownNameError: no such chain, version or tip frame; lists the known ones.
        """
        entry = self.entry(name)
        table = _named(f'version of chain {name}', version, entry.versions)
        tip = _named(f'tip frame of chain {name}',
                     next(iter(table.tip_frames)) if frame is None else frame, table.tip_frames)
        return Chain(
            name=name, version=version, root_frame=table.root_frame, tip=entry.tip,
            tip_frame=tip.frame, joint_names=table.joint_names, links=table.links,
            T_root_0=table.T_root_0, T_n_tip=table.T_n_tip @ tip.T_dh_tip,
            convention=table.convention)


def load_chain(name: str, version: str, *, frame: str | None = None,
               file: str | Path | None = None) -> Chain:
    """Return a chain of a kinematics file.

    Args:
        name: chain, such as `left_leg`.
        version: version, such as `v2_5`.
        frame: tip frame, such as `sole`; the chain's first if None.
        file: kinematics file; the shipped one if None.

    Raises:
        CatalogError: the file cannot be read or has a mistake.
        UnknownNameError: no such chain, version or tip frame; lists the known ones.
    """
    catalog = Catalog.load(file)
    for line in catalog.warnings:
        warnings.warn(line, stacklevel=2)
    return catalog.chain(name, version, frame)


def config_file(name: str) -> Path:
    """Return the path of a shipped configuration file, however the package was installed.

    Looks beside the sources (a checkout or an editable install), then in `share/icub_leg_fk` of
    the prefix the package was installed to (colcon, a Debian package, pip).

    Raises:
        CatalogError: it is in none of these places; lists them.
    """
    package = Path(__file__).parents[1]
    prefixes = [*package.parents, Path(sys.prefix), Path(sysconfig.get_path('data'))]
    shares = [prefix / 'share' / PACKAGE / 'config' for prefix in prefixes]
    places = [package.parent / 'config', *dict.fromkeys(shares)]
    for place in places:
        if (place / name).is_file():
            return place / name
    raise CatalogError(name, 0, 'shipped configuration', 'nothing',
                       'one of ' + ', '.join(map(str, places)))


def _named(kind: str, name: str, things: Mapping[str, _Thing]) -> _Thing:
    if not isinstance(name, str) or name not in things:
        raise UnknownNameError(kind, name, things)
    return things[name]


class _Reader:
    """Reads one kinematics file; units and warnings are known on the way."""

    def __init__(self) -> None:
        self._warnings: list[str] = []
        self._length = self._angle = ''

    def catalog(self, path: Path) -> Catalog:
        root = read_yaml(path)
        top = root.record(('units', 'chains'))
        units = top['units'].record(('length', 'angle'))
        self._length = units['length'].choice(_LENGTHS)
        self._angle = units['angle'].choice(_ANGLES)
        chains = top['chains'].mapping('chains by name', lambda name: f'chain {name}', WORD)
        if not chains:
            top['chains'].fail('at least one chain', 'none')
        entries: dict[str, ChainEntry] = {}
        owners: dict[str, str] = {}
        for name, at in chains.items():
            fields = at.record(('tip', *_PLACE, 'versions'))
            tip = fields['tip'].name('a name', WORD)
            if (owner := owners.setdefault(tip, name)) != name:
                fields['tip'].fail('a tip of its own', f'{tip}, the tip of chain {owner}')
            entries[name] = ChainEntry(name, tip, self._versions(name, fields))
        return Catalog(root.file, entries, tuple(dict.fromkeys(self._warnings)))

    def _versions(self, name: str, chain: Mapping[str, Field]) -> dict[str, ChainVersion]:
        versions = chain['versions'].mapping(
            'versions by name', lambda version: f'chain {name}, version {version}')
        if not versions:
            chain['versions'].fail('at least one version', 'none')
        return {version: self._version(at, chain) for version, at in versions.items()}

    def _version(self, at: Field, chain: Mapping[str, Field]) -> ChainVersion:
        if at.has('virtual_link'):
            at.fail('a last row of links instead, such as '
                    '{a: 0, d: 6.6, alpha: 90, offset: 0, type: fixed}', 'key virtual_link')
        own = at.record(('T_Ro0', 'links'), ('T_nIs', 'convention', 'source', *_PLACE))
        place = {key: own.get(key, chain[key]) for key in _PLACE}
        convention = own['convention'].choice(CONVENTIONS) if 'convention' in own else 'standard'
        rows = [self._link(Field(row.file, f'{row.where}, row {i}', row.node))
                for i, row in enumerate(
                    Field(at.file, at.where, own['links'].node).items('a list of rows'))]
        joint_names = self._joint_names(place['joints'])
        moving = sum(not row.is_fixed for row in rows)
        if moving != len(joint_names):
            own['links'].fail(f'{len(joint_names)}, one per joint',
                              f'{moving} row{"s" * (moving != 1)} with a joint')
        root_frame = place['root_frame'].name('a frame id', FRAME)
        return ChainVersion(
            root_frame=root_frame,
            joint_names=joint_names,
            tip_frames=self._tip_frames(place['tip_frames'], root_frame),
            convention=convention,
            T_root_0=self._transform(own['T_Ro0']),
            links=standard_rows(rows) if convention == 'modified' else tuple(rows),
            T_n_tip=self._transform(own['T_nIs']) if 'T_nIs' in own else np.eye(4),
            source=own['source'].text() if 'source' in own else '',
        )

    def _joint_names(self, at: Field) -> tuple[str, ...]:
        joints: list[str] = []
        for item in at.items('a list of joint names'):
            joint = item.name('a joint name')
            if joint in joints:
                item.fail('each joint once', f'joint {joint} again')
            joints.append(joint)
        return tuple(joints)

    def _tip_frames(self, at: Field, root_frame: str) -> dict[str, TipFrame]:
        frames = {}
        for name, value in at.mapping('tip frames by name',
                                      lambda name: f'{at.where}, {name}', WORD).items():
            fields = value.record(('frame',), ('transform',))
            T = self._transform(fields['transform']) if 'transform' in fields else np.eye(4)
            frame = fields['frame'].name('a frame id', FRAME)
            if frame == root_frame:
                fields['frame'].fail('another frame id than the root frame')
            frames[name] = TipFrame(frame, T)
        if not frames:
            at.fail('at least one tip frame', 'none')
        return frames

    def _link(self, row: Field) -> DHLink:
        fields = row.record(_DH, (*_JOINT, 'type', 'erratum'))
        joint_type = fields['type'].choice(JOINT_TYPES) if 'type' in fields else 'revolute'
        for name in _JOINT:
            if joint_type == 'fixed' and name in fields:
                fields[name].fail('nothing, since a fixed row has no joint')
        slides = joint_type == 'prismatic'
        lower, upper = (self._range(fields['range'], slides) if 'range' in fields
                        else (-math.inf, math.inf))
        return DHLink(
            a=self._metres(fields['a']), d=self._metres(fields['d']),
            alpha=self._radians(fields['alpha']), offset=self._radians(fields['offset']),
            joint_type=joint_type,
            sign=int(fields['sign'].choice(('1', '+1', '-1'))) if 'sign' in fields else 1,
            lower=lower, upper=upper,
            robot_range=(self._range(fields['robot_range'], slides) if 'robot_range' in fields
                         else None),
            erratum=fields['erratum'].text() if 'erratum' in fields else '')

    def _range(self, at: Field, slides: bool) -> tuple[float, float]:
        limits = list(at.items('[lower, upper]', 2))
        lower, upper = [self._metres(limit) if slides else self._radians(limit)
                        for limit in limits]
        if lower > upper:
            at.fail('lower at most upper', ' above '.join(limit.found() for limit in limits))
        return lower, upper

    def _metres(self, at: Field) -> float:
        # Dividing, unlike multiplying by 1e-3, gives the float nearest to the printed value.
        value = at.number(self._length)
        length = value / 1000.0 if self._length == 'mm' else value
        if abs(length) > _LONGEST:
            at.fail(f'a length up to {_LONGEST:g} m')
        if abs(length) > _UNLIKELY:
            self._warn(at, f'{length:g} m is unlikely; the unit of length is {self._length}')
        return length

    def _radians(self, at: Field) -> float:
        if (angle := at.fraction_of_pi()) is not None:
            return angle
        value = at.number(f'{self._angle}, or as in pi/2')
        if self._angle == 'deg':
            return math.radians(value)
        if abs(value) > 2 * math.pi + 1e-3:
            self._warn(at, f'{value:g} rad is unlikely; the unit of angle is rad')
        return value

    def _transform(self, at: Field) -> Array:
        T = np.array([
            [self._entry(number.at(f'column {j}'), i, j)
             for j, number in enumerate(row.at(f'row {i}').items('a row of 4 numbers', 4))]
            for i, row in enumerate(at.items('4 rows of 4 numbers', 4))])
        if not is_rigid_transform(T, _FOUR_DECIMALS):
            at.fail('a rotation (to four decimals at least), a translation and the last row '
                    '0 0 0 1', 'a matrix that is not a rigid transform')
        mended = nearest_rotation(T[:3, :3])
        if (change := float(np.abs(mended - T[:3, :3]).max())) > _EXACT:
            self._warn(at, f'the rotation is rounded; corrected by up to {change:.1g} per entry')
        T[:3, :3] = mended
        return T

    def _entry(self, at: Field, i: int, j: int) -> float:
        return self._metres(at) if i < 3 and j == 3 else at.number()

    def _warn(self, at: Field, text: str) -> None:
        self._warnings.append(f'{at.file}:{at.line}: {at.where}: {text}')
