"""`leg_fk list`: the chains and versions of a kinematics file."""

from __future__ import annotations

import argparse
from typing import Any, TYPE_CHECKING

from icub_leg_fk.tools.chain_arguments import add_json, add_kinematics_file, load_catalog

if TYPE_CHECKING:
    from icub_leg_fk.kinematics.catalog import ChainEntry

HELP = 'list the chains: versions, joints, tip frames'
EXAMPLES = """\
examples:
  leg_fk list
  leg_fk list -k my_robot.yaml
  leg_fk list --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_kinematics_file(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the chains."""
    from icub_leg_fk.tools.text import json_text

    catalog = load_catalog(args)
    if args.json:
        chains = [_as_json(entry) for entry in catalog.chains.values()]
        print(json_text({'file': catalog.file, 'chains': chains}))
        return 0
    print(f'chains of {catalog.file}')
    for entry in catalog.chains.values():
        print()
        print('\n'.join(_as_text(entry)))
    return 0


def _as_text(entry: ChainEntry) -> list[str]:
    from icub_leg_fk.tools.text import columns, indented

    sources = {name: version.source for name, version in entry.versions.items()}
    place = next(iter(entry.versions.values()))
    rows = [['tip', f'{entry.tip}, in {place.root_frame}']]
    rows += [['tip frames' if i == 0 else '', f'{name}: {tip.frame}']
             for i, (name, tip) in enumerate(place.tip_frames.items())]
    rows += [['versions' if i == 0 else '', f'{name}  ({source})' if source else name]
             for i, (name, source) in enumerate(sources.items())]
    names = place.joint_names
    rows += [['joints' if i == 0 else '', '  '.join(names[i:i + 6])]
             for i in range(0, len(names), 6)]
    return [entry.name, *indented(columns(rows))]


def _as_json(entry: ChainEntry) -> dict[str, Any]:
    place = next(iter(entry.versions.values()))
    return {
        'name': entry.name,
        'tip': entry.tip,
        'root_frame': place.root_frame,
        'joints': list(place.joint_names),
        'tip_frames': {name: tip.frame for name, tip in place.tip_frames.items()},
        'versions': [
            {'name': name, 'source': version.source,
             'joint_types': [link.joint_type for link in version.links]}
            for name, version in entry.versions.items()
        ],
    }
