"""The catalog: chains and versions by name, from a kinematics file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import sys
import sysconfig

from icub_leg_fk.errors import CatalogError, UnknownNameError
from icub_leg_fk.kinematics.catalog_file import ChainEntry, read_catalog_file
from icub_leg_fk.kinematics.chain import Chain

PACKAGE = 'icub_leg_fk'
FOOT_FRAMES = ('dh', 'sole')


@dataclass(frozen=True)
class Catalog:
    """Every chain of one kinematics file.

    Attributes:
        file: path of the file.
        chains: the entries by name.
    """

    file: str
    chains: Mapping[str, ChainEntry]

    @classmethod
    def load(cls, path: str | Path | None = None) -> Catalog:
        """Read a kinematics file; the shipped one if none is given.

        Raises:
            CatalogError: the file cannot be read or has a mistake; it names file, line, chain,
                version, row and field, what was found and what is allowed.
        """
        file = Path(path) if path else config_file('icub_kinematics.yaml')
        return cls(str(file), read_catalog_file(file))

    def entry(self, chain: str) -> ChainEntry:
        """Return a chain with all its versions.

        Raises:
            UnknownNameError: no such chain; lists the known ones.
        """
        if chain not in self.chains:
            raise UnknownNameError('chain', chain, self.chains)
        return self.chains[chain]

    def chain(self, name: str, version: str, foot_frame: str = 'dh') -> Chain:
        """Return one version of one chain, ready to compute with.

        Args:
            name: chain, such as `left_leg`.
            version: version, such as `v2_5`.
            foot_frame: axes of the tip, `dh` or, where the chain has one, `sole`.

        Raises:
            UnknownNameError: no such chain, version or tip frame; lists the known ones.
        """
        entry = self.entry(name)
        if version not in entry.versions:
            raise UnknownNameError(f'version of chain {name}', version, entry.versions)
        if foot_frame not in entry.tip_frames:
            raise UnknownNameError(f'tip frame of chain {name}', foot_frame, entry.tip_frames)
        table, tip = entry.versions[version], entry.tip_frames[foot_frame]
        return Chain(
            name=name, version=version, root_frame=entry.root_frame, tip=entry.tip,
            tip_frame=tip.frame, joint_names=entry.joint_names, links=table.links,
            T_root_0=table.T_root_0, virtual_link=table.virtual_link,
            T_n_tip=table.T_n_tip @ tip.T_dh_tip)


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
