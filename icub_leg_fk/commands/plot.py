"""`leg_fk plot`: a picture of the feet over time and of the legs in space."""

import argparse
from collections.abc import Sequence
import math
import os
from pathlib import Path
import sys

from icub_leg_fk.errors import InputFileError, LegFKError
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import options
from icub_leg_fk.tools.drawing import check_output, feet_figure, LETTERS, save_picture
from icub_leg_fk.tools.progress import shown_progress
from icub_leg_fk.tools.recording import ChainTrack, read_tracks, Reading, time_span
import numpy as np

EXAMPLES = """\
INPUT is a rosbag2 bag (directory, .mcap or .db3) with JointState messages, or a CSV file with a
column `time` in seconds and one column per joint, in radians; both are read by the node's own
rules. Gaps and joints outside their ranges are marked. Where samples are closer together than can
be drawn, a curve becomes the band from its lowest to its highest values.

examples:
  leg_fk plot walking.csv
  leg_fk plot walking_bag -o feet.pdf --at 1.5,2.0,2.5
  leg_fk plot long_walk --from 120 --to 125
  leg_fk plot walking.mcap --version v1 --foot-frame sole --joint-topic /icub/joint_states
  leg_fk plot arm.csv -k my_robot.yaml --chains arm"""

_INSTANTS = len(LETTERS)  # at most
_LONGEST_NAME = 50  # characters of a title
_LIKE = 0.02  # so much of the whole movement lower, and an instant is as good as the extreme
_LONGEST_TIME = 1e15  # s


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('input', metavar='INPUT', help='bag or CSV file')
    options.add_output(
        parser,
        'picture to write, .png, .svg or .pdf (default: the name of INPUT '
        'with .png, in this directory)',
    )
    options.add(
        parser,
        '--chains',
        '--version',
        '--foot-frame',
        '--joint-topic',
        '--kinematics-file',
    )
    parser.add_argument(
        '--at',
        metavar='T[,T...]',
        type=_times,
        help=f'up to {_INSTANTS} times [s] at which to draw the legs (default: '
        'where one foot is highest above the other, or farthest ahead)',
    )
    time = options.number_between(-_LONGEST_TIME, _LONGEST_TIME, 'a time in seconds')
    parser.add_argument(
        '--from',
        dest='begin',
        metavar='T',
        type=time,
        help='draw only from this time [s] (default: the first pose)',
    )
    parser.add_argument(
        '--to',
        dest='end',
        metavar='T',
        type=time,
        help='draw only to this time [s] (default: the last pose)',
    )


def run(args: argparse.Namespace) -> int:
    """Draw the picture."""
    name = os.path.basename(os.path.realpath(args.input))
    output = args.output or f'{Path(name).stem}.png'
    check_output(output, args.force)
    if not Path(args.input).exists():
        raise InputFileError(
            args.input,
            'there is no such file or directory; allowed: a bag or a CSV file',
        )
    chains = options.chains_of_one_root(args)
    with shown_progress(name) as progress:
        reading = read_tracks(args.input, chains, args.joint_topic, progress)
    tracks = _between(reading.tracks, args.begin, args.end)
    instants = (
        _checked_instants(args.at, tracks) if args.at else default_instants(tracks)
    )
    title = _title(name, tracks)
    save_picture(lambda: feet_figure(tracks, instants, title), output, force=args.force)
    poses = ', '.join(_pose_count(track) for track in tracks)
    print(f'{output}: {poses}')
    _print_notes(reading)
    return 0


def default_instants(tracks: Sequence[ChainTrack]) -> list[float]:
    """Return up to four times [s] worth drawing.

    Of two feet those where one is highest above the other and farthest ahead of it, both ways;
    else, and if the feet hardly move, evenly spaced ones.
    """
    start, end = time_span(tracks)
    if start == end:
        return [start]
    if len(tracks) == 2 and all((np.diff(track.times) >= 0).all() for track in tracks):
        one, two = tracks
        instants = _far_apart(one, two, start, end)
        if len(set(instants)) == _INSTANTS:
            return sorted(instants)
    return [float(time) for time in np.linspace(start, end, _INSTANTS)]


def _far_apart(
    one: ChainTrack, two: ChainTrack, start: float, end: float
) -> list[float]:
    """Return when one foot is highest above the other and farthest ahead of it, both ways [s]."""
    columns = [np.interp(one.times, two.times, two.poses[:, i]) for i in range(3)]
    apart = one.poses[:, :3] - np.stack(columns, axis=1)
    above, ahead = apart[:, 2], apart[:, 0]
    instants = []
    for i, distance in enumerate((above, ahead, -above, -ahead)):
        # Of a gait's many steps one of the i-th quarter, so that the picture is spread out.
        quarter = start + (end - start) * (i + 0.5) / _INSTANTS
        instants.append(_extreme_near(one.times, distance, quarter))
    return instants


def _extreme_near(times: Array, distance: Array, near: float) -> float:
    """Return the time [s] nearest to one at which an (N,) distance is as good as largest."""
    is_large = distance >= distance.max() - _LIKE * np.ptp(distance)
    like = times[is_large]
    return float(like[np.abs(like - near).argmin()])


def _between(
    tracks: Sequence[ChainTrack], begin: float | None, end: float | None
) -> list[ChainTrack]:
    """Return the parts of the tracks from one time to another [s]."""
    start, stop = time_span(tracks)
    begin = start if begin is None else begin
    end = stop if end is None else end
    inside = [(track.times >= begin) & (track.times <= end) for track in tracks]
    if not all(mask.any() for mask in inside):
        raise LegFKError(
            f'--from, --to: found {begin:g} to {end:g} s, in which not every chain '
            f'has a pose; the recording goes from {start:g} to {stop:g} s'
        )
    return [track.where(mask) for track, mask in zip(tracks, inside)]


def _checked_instants(
    instants: Sequence[float], tracks: Sequence[ChainTrack]
) -> list[float]:
    """Return the times at which to draw the legs, in order [s]."""
    start, end = time_span(tracks)
    outside = [instant for instant in instants if not start <= instant <= end]
    if outside:
        raise LegFKError(
            f'--at: found {outside[0]:g} s, allowed: {start:g} to {end:g} s'
        )
    return sorted(instants)


def _times(text: str) -> list[float]:
    times = [options.number(word) for word in text.split(',')]
    if len(times) > _INSTANTS or not all(map(math.isfinite, times)):
        raise argparse.ArgumentTypeError(
            f'found {text.strip()!r}, allowed: up to {_INSTANTS} '
            'times in seconds, separated by commas'
        )
    return times


def _title(name: str, tracks: Sequence[ChainTrack]) -> str:
    """Return the name of the recording, if not too long, with the versions of the chains."""
    shown = os.fsencode(name).decode(
        errors='backslashreplace'
    )  # a name need not be text
    if len(shown) > _LONGEST_NAME:
        shown = f'{shown[:_LONGEST_NAME]}...'
    versions = ', '.join(dict.fromkeys(track.chain.version for track in tracks))
    return f'{shown}   {versions}'


def _pose_count(track: ChainTrack) -> str:
    count = len(track.times)
    return f'{count} pose{"s" * (count != 1)} of {track.chain.tip}'


def _print_notes(reading: Reading) -> None:
    """Print what a user should know of a recording, each in one line on stderr."""
    for warning in reading.warnings:
        print(f'leg_fk: warning: {warning}', file=sys.stderr)
    for note in reading.notes:
        print(f'leg_fk: note: {note}', file=sys.stderr)
