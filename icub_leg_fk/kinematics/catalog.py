"""The catalog: chains and versions by name, from a kinematics file in the units of its tables."""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
import sys
import sysconfig
import warnings

from icub_leg_fk.errors import (
    CatalogError,
    LegFKError,
    UnknownNameError,
    VersionNeededError,
)
from icub_leg_fk.kinematics.chain import Chain
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.input_bytes import first_bytes
from icub_leg_fk.kinematics.kinematics_file import (
    ChainEntry,
    listed,
    read_kinematics_file,
)
from icub_leg_fk.kinematics.urdf_chains import doubts, UrdfChains
from icub_leg_fk.kinematics.urdf_file import Urdf
from icub_leg_fk.kinematics.yaml_fields import MAX_BYTES

PACKAGE = 'icub_leg_fk'
SHIPPED_FILE = 'icub_kinematics.yaml'

_BEFORE_TEXT = b' \t\r\n\0' + codecs.BOM_UTF8 + codecs.BOM_UTF16_LE


@dataclass(frozen=True, eq=False, repr=False)
class Catalog(Frozen):
    """Every chain of one kinematics file or URDF. Two catalogs with the same chains are equal.

    Attributes:
        file: path of the file.
        chains: the entries by name.
        warnings: what can be computed with but can hardly be meant, one line each.
    """

    file: str = field(compare=False)
    chains: Mapping[str, ChainEntry]
    warnings: tuple[str, ...] = field(default=(), compare=False)

    @classmethod
    def load(
        cls,
        path: str | Path | None = None,
        *,
        root: str | None = None,
        tolerance: float = 0.0,
    ) -> Catalog:
        """Read a kinematics file or a URDF, known by its content; the shipped file by default.

        Args:
            path: the file.
            root: of a URDF, the link that poses are given in; `root_link` or else the top if
                None or empty.
            tolerance: of a URDF, angle up to which its tables are tidied for people [rad]; 0 for
                exact ones.

        Raises:
            CatalogError: the file cannot be read or has a mistake; it names file, line, chain,
                version, row and field, what was found and what is allowed.
            InputFileError: the file is a URDF that cannot be read; says why.
            UnknownNameError: the URDF has no such root link.
        """
        if path is not None and _holds_xml(path):
            return cls.from_urdf(Urdf.load(path), root=root, tolerance=tolerance)
        file, chains, lines = read_kinematics_file(path or config_file(SHIPPED_FILE))
        if root:
            lines = (
                *lines,
                f'{file}: is not a URDF; the root link {root!r} is ignored',
            )
        return cls(file, chains, lines)

    @classmethod
    def from_urdf(
        cls, urdf: Urdf, *, root: str | None = None, tolerance: float = 0.0
    ) -> Catalog:
        """Return the chains of a URDF: the shipped ones that it has, and those to its links.

        Args:
            urdf: the robot.
            root: the link that poses are given in; `root_link` or else the top if None or empty.
            tolerance: angle up to which the tables are tidied for people [rad]; 0 for exact ones.

        Raises:
            InputFileError: no root is given, and the URDF has no `root_link` and not just one link
                at the top.
            UnknownNameError: the URDF has no such root link.
        """
        start = root or urdf.root()
        urdf.check_link(start)
        chains = UrdfChains(urdf, start, _shipped_chains(), tolerance)
        return cls(urdf.file, chains, doubts(urdf))

    def known(self) -> dict[str, str]:
        """Return the tips of the shipped chains that a URDF has, or of all of a file, by chain."""
        if isinstance(self.chains, UrdfChains):
            return self.chains.known()
        return {name: entry.tip for name, entry in self.chains.items()}

    def entry(self, chain: str) -> ChainEntry:
        """Return a chain with all its versions.

        Raises:
            UnknownNameError: no such chain; lists the known ones, and says whose tip or frame it
                is.
        """
        if not isinstance(chain, str) or chain not in self.chains:
            raise UnknownNameError('chain', chain, self.chains, self._owner(chain))
        return self.chains[chain]

    def chain(
        self, name: str, version: str | None = None, frame: str | None = None
    ) -> Chain:
        """Return one version of one chain, ready to compute with.

        Args:
            name: chain, such as `left_leg`, or a chain with its version, such as `head_imu=v2`.
            version: version of a chain that is named without one, such as `v2_5`; its default if
                None or empty.
            frame: tip frame, such as `sole`; the chain's first if None or empty.

        Raises:
            UnknownNameError: no such chain, version or tip frame; lists the known ones.
            VersionNeededError: no version is given, and the chain has several and no default.
        """
        chain, own_version = self.split(name)
        entry = self.entry(chain)
        chosen = own_version or version or entry.default_version
        if not chosen:
            raise VersionNeededError(chain, entry.versions)
        if not isinstance(chosen, str) or chosen not in entry.versions:
            raise UnknownNameError(
                'version', chosen, entry.versions, of=f'chain {chain}'
            )
        found = entry.versions[chosen]
        return found.with_frame(frame) if frame else found

    def select(
        self, names: Iterable[str], version: str | None = None
    ) -> tuple[Chain, ...]:
        """Return chains that are to be used together: published, recorded, drawn or written.

        Args:
            names: chains, such as `left_leg` or `head_imu=v2`.
            version: version of every chain that is named without one; their defaults if None.

        Raises:
            UnknownNameError: no such chain or version; lists the known ones.
            VersionNeededError: a chain has several versions and no default.
            LegFKError: no list, no chain, a chain twice, chains whose roots share a name but not
                axes, or chains whose tips would have one topic.
        """
        if isinstance(names, str):
            raise LegFKError(f'chains are {names!r}; allowed: a list of names')
        chains: dict[str, Chain] = {}
        for name in names:
            chain = self._selected(name, version)
            if chain.name in chains:
                raise LegFKError(
                    f'chain {chain.name} is named twice; allowed: each chain once'
                )
            chains[chain.name] = chain
        if not chains:
            known = listed(self.chains) or 'none'
            raise LegFKError(f'no chain is named; allowed: one or more of {known}')
        _refuse_conflicting_roots(chains.values())
        _refuse_shared_tips(chains.values())
        return tuple(chains.values())

    def split(self, name: str) -> tuple[str, str]:
        """Return chain and version of `head_imu=v2`; an empty version where none is named."""
        if not isinstance(name, str) or name in self.chains:
            return name, ''
        chain, _, version = name.rpartition('=')
        return (chain, version) if chain and version else (name, '')

    def _selected(self, name: str, version: str | None) -> Chain:
        """Return a chain; if it lacks the version given for all, the error says how to name it."""
        try:
            return self.chain(name, version)
        except UnknownNameError as error:
            is_for_all = name in self.chains and error.name == version
            if not is_for_all:
                raise
            example = self.chains[name].default_version or error.choices[-1]
            advice = f'its own version is given as in {name}={example}'
            raise UnknownNameError(
                error.kind, error.name, error.choices, advice, error.of
            ) from error

    def _owner(self, name: str) -> str:
        """Return whose tip or frame a name is; nothing if it is neither."""
        for chain_name, tip in self.known().items():
            if name == tip:
                return f'{name} is the tip of {chain_name}'
        if isinstance(self.chains, UrdfChains):  # whose frames are chains
            return ''
        for entry in self.chains.values():
            for chain in entry.versions.values():
                for frame, tip_frame in chain.tip_frames.items():
                    if name == tip_frame.frame_id:
                        return f'{name} is the {frame} frame of {entry.name}'
        return ''

    def __repr__(self) -> str:
        return f'<Catalog {Path(self.file).name[:40]}: {listed(self.chains)}>'


@cache
def _shipped_chains() -> Mapping[str, ChainEntry]:
    """Return the shipped chains; reading their file takes longer than making a robot's tables."""
    return Catalog.load().chains


def load_chain(
    name: str,
    version: str | None = None,
    *,
    frame: str | None = None,
    file: str | Path | None = None,
    root: str | None = None,
) -> Chain:
    """Return a chain of a kinematics file or URDF.

    Args:
        name: chain, such as `left_leg`, or a link of a URDF.
        version: version, such as `v2_5`; the file's default if None.
        frame: tip frame, such as `sole`; the chain's first if None.
        file: kinematics file or URDF; the shipped kinematics file if None.
        root: of a URDF, the link that poses are given in; `root_link` or else the top if None.

    Raises:
        InputFileError: the file cannot be read or has a mistake.
        UnknownNameError: no such chain, version or tip frame; lists the known ones.
        VersionNeededError: no version is given, and the chain has several and no default.
    """
    catalog = Catalog.load(file, root=root)
    for line in catalog.warnings:
        warnings.warn(line, stacklevel=2)
    return catalog.chain(name, version, frame)


def config_file(name: str) -> Path:
    """Return the path of a shipped configuration file, however the package was installed.

    Looks next to the sources (a checkout or an editable install), then in `share/icub_leg_fk` of
    the prefix the package was installed to (colcon, a Debian package, pip).

    Raises:
        CatalogError: it is in none of these places; lists them.
    """
    package = Path(__file__).parents[1]
    places = [package.parent / 'config']
    if not (places[0] / name).is_file():
        data = Path(sysconfig.get_path('data'))  # which takes a start 1 ms
        prefixes = dict.fromkeys([*package.parents, Path(sys.prefix), data])
        places += [prefix / 'share' / PACKAGE / 'config' for prefix in prefixes]
    for place in places:
        if (place / name).is_file():
            return place / name
    raise CatalogError(
        name,
        0,
        'shipped configuration',
        'nothing',
        'one of ' + ', '.join(map(str, places)),
    )


def _refuse_shared_tips(chains: Iterable[Chain]) -> None:
    """Refuse chains whose tips would have one topic, as links `a b` and `a_b` of a URDF."""
    first_of: dict[str, Chain] = {}
    for chain in chains:
        first = first_of.setdefault(chain.tip, chain)
        if first is not chain:
            raise LegFKError(
                f'chains {first.name} and {chain.name} do not go together: the name '
                f'of their tips in topics is {chain.tip}'
            )


def _holds_xml(path: str | Path) -> bool:
    """Return whether a file is a URDF, or at least is meant to be one."""
    start = first_bytes(path, MAX_BYTES)
    robot, chains = start.find(b'<robot'), start.find(b'chains:')
    if start.lstrip(_BEFORE_TEXT).startswith((b'<', b'data:')):
        return True
    return robot >= 0 and not 0 <= chains < robot


def _refuse_conflicting_roots(chains: Iterable[Chain]) -> None:
    """Refuse chains whose root frames have one name and other axes."""
    first_of: dict[str, Chain] = {}
    for chain in chains:
        if not chain.root_axes:
            continue
        first = first_of.setdefault(chain.root_frame, chain)
        if first.root_axes != chain.root_axes:
            raise LegFKError(
                f'{first.name}={first.version} and {chain.name}={chain.version} do not go '
                f'together: x, y, z of {chain.root_frame} point {", ".join(first.root_axes)} in '
                f'the one and {", ".join(chain.root_axes)} in the other'
            )
