"""From a kinematics file in the units of the printed tables to chains in metres and radians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from pathlib import Path

from icub_leg_fk.kinematics.link import DHLink, JOINT_TYPES
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.yaml_fields import Field, read_yaml, WORD
import numpy as np

_LENGTHS = ('mm', 'm')
_ANGLES = ('deg', 'rad')
_LONGEST = 1e9  # m; what is larger leaves no room to compute with
_CHAIN = ('tip', 'root_frame', 'joints', 'tip_frames', 'versions')
_DH = ('a', 'd', 'alpha', 'offset')


@dataclass(frozen=True)
class TipFrame:
    """A frame in which the tip's pose can be given: its frame id and its place on the tip."""

    frame: str
    T_dh_tip: Array


@dataclass(frozen=True)
class ChainVersion:
    """What differs between the versions of one chain; lengths [m], angles [rad]."""

    T_root_0: Array
    links: tuple[DHLink, ...]
    virtual_link: DHLink | None
    T_n_tip: Array
    source: str


@dataclass(frozen=True)
class ChainEntry:
    """A chain of the file with all its versions."""

    name: str
    tip: str
    root_frame: str
    joint_names: tuple[str, ...]
    tip_frames: Mapping[str, TipFrame]
    versions: Mapping[str, ChainVersion]


@dataclass(frozen=True)
class _Units:
    length: str
    angle: str

    def metres(self, field: Field) -> float:
        # Dividing, unlike multiplying by 1e-3, gives the float nearest to the printed value.
        value = field.number(self.length)
        length = value / 1000.0 if self.length == 'mm' else value
        if abs(length) > _LONGEST:
            field.fail(f'a length up to {_LONGEST:g} m')
        return length

    def radians(self, field: Field) -> float:
        value = field.number(self.angle)
        return math.radians(value) if self.angle == 'deg' else value

    def transform(self, field: Field) -> Array:
        T = np.array([
            [self._entry(number.at(f'column {j}'), i, j) for j, number in enumerate(
                row.at(f'row {i}').items('a row of 4 numbers', 4))]
            for i, row in enumerate(field.items('4 rows of 4 numbers', 4))])
        if not is_rigid_transform(T):
            field.fail('a rotation, a translation and the last row 0 0 0 1', 'no rigid transform')
        T[:3, :3] = nearest_rotation(T[:3, :3])
        return T

    def _entry(self, field: Field, i: int, j: int) -> float:
        return self.metres(field) if i < 3 and j == 3 else field.number()


def read_catalog_file(path: str | Path) -> dict[str, ChainEntry]:
    """Return the chains of a kinematics file by name.

    Raises:
        CatalogError: the first mistake in the file.
    """
    top = read_yaml(path).record(('units', 'chains'))
    unit_fields = top['units'].record(('length', 'angle'))
    units = _Units(unit_fields['length'].choice(_LENGTHS), unit_fields['angle'].choice(_ANGLES))
    chains = top['chains'].mapping('chains by name', lambda name: f'chain {name}', WORD)
    if not chains:
        top['chains'].fail('at least one chain', 'none')
    entries = {name: _chain(name, field, units) for name, field in chains.items()}
    owners: dict[str, str] = {}
    for name, entry in entries.items():
        owner = owners.setdefault(entry.tip, name)
        if owner != name:
            tip = chains[name].record(_CHAIN)['tip']
            tip.fail('a tip of its own', f'{entry.tip}, the tip of chain {owner}')
    return entries


def _chain(name: str, field: Field, units: _Units) -> ChainEntry:
    fields = field.record(_CHAIN)
    joints: list[str] = []
    for item in fields['joints'].items('a list of joint names'):
        joint = item.name('a joint name')
        if joint in joints:
            item.fail('each joint once', f'joint {joint} twice')
        joints.append(joint)
    versions = fields['versions'].mapping(
        'versions by name', lambda version: f'chain {name}, version {version}')
    if not versions:
        fields['versions'].fail('at least one version', 'none')
    return ChainEntry(
        name=name,
        tip=fields['tip'].name('a name', WORD),
        root_frame=fields['root_frame'].name('a frame id'),
        joint_names=tuple(joints),
        tip_frames=_tip_frames(fields['tip_frames'], units),
        versions={version: _version(at, len(joints), units) for version, at in versions.items()},
    )


def _tip_frames(field: Field, units: _Units) -> dict[str, TipFrame]:
    frames = {}
    for name, value in field.record(('dh',), ('sole',)).items():
        optional = ('transform',) if name != 'dh' else ()
        fields = value.record(('frame',), optional)
        T = units.transform(fields['transform']) if 'transform' in fields else np.eye(4)
        frames[name] = TipFrame(fields['frame'].name('a frame id'), T)
    return frames


def _version(field: Field, n_joints: int, units: _Units) -> ChainVersion:
    fields = field.record(('T_Ro0', 'links'), ('virtual_link', 'T_nIs', 'source'))
    kind = f'{n_joints} rows, one per joint'
    rows = [Field(field.file, f'{field.where}, row {i}', row.node)
            for i, row in enumerate(fields['links'].items(kind, n_joints))]
    virtual = fields.get('virtual_link')
    return ChainVersion(
        T_root_0=units.transform(fields['T_Ro0']),
        links=tuple(_link(row, units) for row in rows),
        virtual_link=None if virtual is None else _virtual_link(virtual, units),
        T_n_tip=units.transform(fields['T_nIs']) if 'T_nIs' in fields else np.eye(4),
        source=fields['source'].text() if 'source' in fields else '',
    )


def _link(row: Field, units: _Units) -> DHLink:
    fields = row.record(_DH, ('range', 'type', 'erratum'))
    joint_type = fields['type'].choice(JOINT_TYPES) if 'type' in fields else 'revolute'
    lower, upper = -math.inf, math.inf
    if 'range' in fields:
        convert = units.metres if joint_type == 'prismatic' else units.radians
        limits = list(fields['range'].items('[lower, upper]', 2))
        lower, upper = map(convert, limits)
        if lower > upper:
            found = ' above '.join(limit.found() for limit in limits)
            fields['range'].fail('lower at most upper', found)
    return DHLink(
        a=units.metres(fields['a']), d=units.metres(fields['d']),
        alpha=units.radians(fields['alpha']), offset=units.radians(fields['offset']),
        joint_type=joint_type, lower=lower, upper=upper,
        erratum=fields['erratum'].text() if 'erratum' in fields else '')


def _virtual_link(row: Field, units: _Units) -> DHLink:
    fields = row.record(_DH)
    return DHLink(a=units.metres(fields['a']), d=units.metres(fields['d']),
                  alpha=units.radians(fields['alpha']), offset=units.radians(fields['offset']))
