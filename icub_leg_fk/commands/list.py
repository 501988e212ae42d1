"""`leg_fk list`: the chains and versions of a kinematics file."""

import argparse
from typing import Any

from icub_leg_fk.kinematics import ChainEntry
from icub_leg_fk.tools import options, text

EXAMPLES = """\
examples:
  leg_fk list
  leg_fk list -k my_robot.yaml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, '--kinematics-file', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the chains."""
    catalog = options.load_catalog(args)
    entries = catalog.chains.values()
    print(text.as_json({'file': catalog.file, 'chains': [_as_json(entry) for entry in entries]})
          if args.json else
          '\n'.join([f'chains of {catalog.file}', *(_as_text(entry) for entry in entries)]))
    return 0


def _as_text(entry: ChainEntry) -> str:
    table = next(iter(entry.versions.values()))
    joints = table.joint_names
    rows = []
    for title, values in (
            ('tip', [f'{entry.tip}, in {table.root_frame}']),
            ('tip frames', [f'{name}: {tip.frame_id}' for name, tip in table.tip_frames.items()]),
            ('versions', [f'{name}  ({version.source})' if version.source else name
                          for name, version in entry.versions.items()]),
            ('joints', ['  '.join(joints[i:i + 6]) for i in range(0, len(joints), 6)])):
        rows += [[title if i == 0 else '', value] for i, value in enumerate(values)]
    return '\n'.join(['', entry.name, *text.indented(text.columns(rows))])


def _as_json(entry: ChainEntry) -> dict[str, Any]:
    table = next(iter(entry.versions.values()))
    return {
        'name': entry.name, 'tip': entry.tip, 'root_frame': table.root_frame,
        'joints': list(table.joint_names),
        'tip_frames': {name: tip.frame_id for name, tip in table.tip_frames.items()},
        'versions': [{'name': name, 'source': version.source,
                      'joint_types': [link.joint_type for link in version.links]}
                     for name, version in entry.versions.items()]}
