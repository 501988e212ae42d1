"""`leg_fk plot`: a picture of the feet over time and of the legs in space."""

import argparse
from collections.abc import Sequence
import math
from pathlib import Path
import sys

from icub_leg_fk.errors import InputFileError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.stream.configuration import LEGS
from icub_leg_fk.tools import options
from icub_leg_fk.tools.drawing import check_output, feet_figure, save_picture
from icub_leg_fk.tools.recording import ChainTrack, read_bag, read_csv, time_span
import numpy as np

EXAMPLES = """\
INPUT is a rosbag2 bag (directory, .mcap or .db3) with JointState messages, read by the node's
own rules, or a CSV file with a column `time` in seconds and one column per joint, in radians.
Gaps and joints outside their ranges are marked. Where samples are closer together than can be
drawn, a curve becomes the band from its lowest to its highest values.

examples:
  leg_fk plot walking.csv
  leg_fk plot walking_bag -o feet.pdf --at 1.5,2.0,2.5
  leg_fk plot long_walk --from 120 --to 125
  leg_fk plot walking.mcap --version v1 --foot-frame sole --joint-topic /icub/joint_states
  leg_fk plot arm.csv -k my_robot.yaml --version v1 --chains arm"""

_INSTANTS = 4  # at most
_LONGEST_NAME = 50  # characters of a title
_LIKE = 0.02  # so much of the whole movement lower, and an instant is as good as the extreme


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('input', metavar='INPUT', type=Path, help='bag or CSV file')
    options.add_output(parser, 'picture to write, .png, .svg or .pdf (default: the name of INPUT '
                       'with .png, in this directory)')
    options.add(parser, '--chains', '--version', '--foot-frame', '--joint-topic', '--kinematics-file')
    parser.add_argument('--at', metavar='T[,T...]', type=_times,
                        help=f'up to {_INSTANTS} times [s] at which to draw the legs (default: '
                             'where one foot is highest above the other, or farthest ahead)')
    for option, name, end in (('from', 'begin', 'first'), ('to', 'end', 'last')):
        parser.add_argument(f'--{option}', dest=name, metavar='T',
                            type=options.number_between(-1e15, 1e15, 'a time in seconds'),
                            help=f'draw only {option} this time [s] (default: the {end} pose)')


def run(args: argparse.Namespace) -> int:
    """Draw the picture."""
    name = args.input.resolve().name
    output = Path(args.output or f'{Path(name).stem}.png')
    check_output(output, args.force)
    if not args.input.exists():
        raise InputFileError(f'{args.input}: there is no such file or directory; allowed: a bag '
                             'or a CSV file')
    catalog = options.load_catalog(args)
    chains = _chosen_chains(catalog, args)
    if len(roots := {chain.root_frame for chain in chains}) > 1:
        raise LegFKError(f'--chains: found the root frames {", ".join(sorted(roots))}, allowed: '
                         'chains of one root frame')
    if args.input.suffix.lower() != '.csv':
        tracks, poseless = read_bag(args.input, chains, args.joint_topic)
    elif args.joint_topic is None:
        recording = read_csv(args.input, dict.fromkeys(
            name for chain in chains for name in chain.joint_names))
        tracks, poseless = [recording.track(chain) for chain in chains], []
    else:
        raise LegFKError(f'--joint-topic: {args.input} is a CSV file, which has no topics')
    tracks = _between(tracks, args.begin, args.end)
    start, end = time_span(tracks)
    if outside := [instant for instant in args.at or () if not start <= instant <= end]:
        raise LegFKError(f'--at: found {outside[0]:g} s, allowed: {start:g} to {end:g} s')
    instants = sorted(args.at) if args.at else default_instants(tracks)
    shown = name if len(name) <= _LONGEST_NAME else f'{name[:_LONGEST_NAME]}...'
    title = f'{shown}   {", ".join(dict.fromkeys(chain.version for chain in chains))}'
    save_picture(lambda: feet_figure(tracks, instants, title), output, force=args.force)
    poses = ', '.join(f'{len(track.times)} pose{"s" * (len(track.times) != 1)} of '
                      f'{track.chain.tip}' for track in tracks)
    print(f'{output}: {poses}')
    if doubtful := [joint for track in tracks for joint in _like_degrees(track)]:
        print(f'leg_fk: warning: positions look like degrees, radians are expected: '
              f'{", ".join(doubtful)}', file=sys.stderr)
    for words in poseless:
        print(f'leg_fk: note: not drawn: {words}', file=sys.stderr)
    return 0


def default_instants(tracks: Sequence[ChainTrack]) -> list[float]:
    """Return up to four times [s] worth drawing.

    Of two feet those where one is highest above the other and farthest ahead of it, both ways;
    else, and if the feet hardly move, evenly spaced ones.
    """
    start, end = time_span(tracks)
    if len(tracks) == 2 and all((np.diff(track.times) >= 0).all() for track in tracks):
        one, two = tracks
        apart = one.poses[:, :3] - np.stack(
            [np.interp(one.times, two.times, two.poses[:, i]) for i in range(3)], axis=1)
        instants = []
        for i, (axis, sign) in enumerate(((2, 1), (0, 1), (2, -1), (0, -1))):
            height = sign * apart[:, axis]
            like = one.times[height >= height.max() - _LIKE * np.ptp(height)]
            # Of a gait's many steps one of the i-th quarter, so that the picture is spread out.
            quarter = start + (end - start) * (i + 0.5) / _INSTANTS
            instants.append(float(like[np.abs(like - quarter).argmin()]))
        if len(set(instants)) == _INSTANTS:
            return sorted(instants)
    return np.linspace(start, end, _INSTANTS).tolist() if end > start else [start]


def _like_degrees(track: ChainTrack) -> list[str]:
    """Return the joints that are whole turns beyond their ranges, by the node's rule."""
    chain, q = track.chain, track.positions
    beyond = np.minimum(np.abs(q), np.maximum(chain.lower - q, q - chain.upper)).max(axis=0)
    return [name for name, link, far in zip(chain.joint_names, chain.joints, beyond.tolist())
            if far > 2 * math.pi and not link.is_prismatic]


def _chosen_chains(catalog: Catalog, args: argparse.Namespace) -> list[Chain]:
    """Return the chains asked for, or both legs, or else all that the catalog has."""
    legs = [name for name in LEGS if name in catalog.chains]
    chains = catalog.select(args.chains or legs or [*catalog.chains], args.version)
    if args.foot_frame is None:
        return list(chains)
    return [chain.with_frame(args.foot_frame) for chain in chains]


def _between(tracks: Sequence[ChainTrack], begin: float | None, end: float | None
             ) -> list[ChainTrack]:
    """Return the parts of the tracks from one time to another [s]."""
    start, stop = time_span(tracks)
    begin, end = start if begin is None else begin, stop if end is None else end
    inside = [(track.times >= begin) & (track.times <= end) for track in tracks]
    if not all(mask.any() for mask in inside):
        raise LegFKError(f'--from, --to: found {begin:g} to {end:g} s, in which not every chain '
                         f'has a pose; the recording goes from {start:g} to {stop:g} s')
    return [track.where(mask) for track, mask in zip(tracks, inside)]


def _times(text: str) -> list[float]:
    times = [options.number(word) for word in text.split(',')]
    if len(times) > _INSTANTS or not all(map(math.isfinite, times)):
        raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: up to {_INSTANTS} '
                                         'times in seconds, separated by commas')
    return times
