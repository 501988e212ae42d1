"""`leg_fk list`: the chains and versions of a kinematics file."""

import argparse
from collections.abc import Callable
from typing import Any

from icub_leg_fk.kinematics import Chain, ChainEntry
from icub_leg_fk.kinematics.chain_text import printable
from icub_leg_fk.tools import options, text

EXAMPLES = """\
examples:
  leg_fk list
  leg_fk list -k my_robot.yaml"""

_JOINTS_IN_A_LINE = 6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, '--kinematics-file', '--root', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the chains."""
    catalog = options.load_catalog(args)
    options.refuse_no_chains(catalog)
    entries = catalog.chains.values()
    if args.json:
        chains = [_as_json(entry) for entry in entries]
        print(text.as_json({'file': catalog.file, 'chains': chains}))
        return 0
    print(f'chains of {catalog.file}')
    for entry in entries:
        print(f'\n{printable(entry.name)}')
        print(*text.indented(_as_text(entry)), sep='\n')
    return 0


def _as_text(entry: ChainEntry) -> list[str]:
    paragraphs = {
        'tip': _by_version(
            entry, lambda chain: [f'{chain.tip}, in {chain.root_frame}']
        ),
        'root axes': _by_version(entry, _root_axes),
        'tip frames': _by_version(entry, _tip_frames),
        'versions': [_version(entry, version) for version in entry.versions],
        'joints': _by_version(entry, _joints),
    }
    rows: list[tuple[str, str]] = []
    for title, lines in paragraphs.items():
        titles = [title] + [''] * (len(lines) - 1)
        rows += zip(titles, lines)
    return text.columns(rows)


def _by_version(entry: ChainEntry, lines_of: Callable[[Chain], list[str]]) -> list[str]:
    """Return the lines on a chain; where versions differ, under the versions that they are for."""
    versions_with: dict[tuple[str, ...], list[str]] = {}
    for version, chain in entry.versions.items():
        versions_with.setdefault(tuple(lines_of(chain)), []).append(version)
    if len(versions_with) == 1:
        return list(*versions_with)
    prefixed = []
    for lines, versions in versions_with.items():
        prefixed += [f'{", ".join(versions)}: {line}' for line in lines]
    return prefixed


def _root_axes(chain: Chain) -> list[str]:
    axes = [f'{name} {direction}' for name, direction in zip('xyz', chain.root_axes)]
    return [', '.join(axes)] if axes else []


def _tip_frames(chain: Chain) -> list[str]:
    return [f'{name}: {frame.frame_id}' for name, frame in chain.tip_frames.items()]


def _version(entry: ChainEntry, version: str) -> str:
    source = entry.versions[version].source
    words = [version]
    if version == entry.default_version:
        words.append('(default)')
    if source:
        words.append(f'({source})')
    return '  '.join(words)


def _joints(chain: Chain) -> list[str]:
    names = chain.joint_names
    lines = []
    for start in range(0, chain.n, _JOINTS_IN_A_LINE):
        end = start + _JOINTS_IN_A_LINE
        lines.append('  '.join(names[start:end]))
    return lines


def _as_json(entry: ChainEntry) -> dict[str, Any]:
    first = next(iter(entry.versions.values()))
    tip_frames = {name: frame.frame_id for name, frame in first.tip_frames.items()}
    return {
        'name': entry.name,
        'tip': entry.tip,
        'root_frame': first.root_frame,
        'joints': list(first.joint_names),
        'tip_frames': tip_frames,
        'versions': [_version_as_json(entry, version) for version in entry.versions],
    }


def _version_as_json(entry: ChainEntry, version: str) -> dict[str, Any]:
    chain = entry.versions[version]
    return {
        'name': version,
        'default': version == entry.default_version,
        'source': chain.source,
        'root_axes': list(chain.root_axes),
        'joint_types': [link.joint_type for link in chain.links],
    }
