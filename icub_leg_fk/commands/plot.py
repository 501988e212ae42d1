"""`leg_fk plot`: a picture of the feet over time and of the legs in space."""

import argparse
from collections import Counter
from collections.abc import Sequence
import math
import os
from pathlib import Path

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import options
from icub_leg_fk.tools.drawing import check_output, feet_figure, LETTERS, save_picture
from icub_leg_fk.tools.progress import part_of, Progress, shown_progress
from icub_leg_fk.tools.recorded_robot import Described, recorded_chains
from icub_leg_fk.tools.tracks import ChainTrack, read_tracks, time_span
import numpy as np

EXAMPLES = """\
RECORDING is a rosbag2 bag (directory, .mcap or .db3), a CSV file with a column of times and one
per joint in radians, or a directory of yarpdatadumper; several of them are parts of one robot.
They are read by the node's own rules. Gaps and joints outside their ranges are marked. Where
samples are closer together than can be drawn, a curve becomes the band from its lowest to its
highest values.

examples:
  leg_fk plot walking.csv
  leg_fk plot walking -o feet.pdf --at 1.5,2.0,2.5
  leg_fk plot today --over yesterday --orientation
  leg_fk plot long_walk --from 120 --to 125
  leg_fk plot walking.mcap --version v1 --foot-frame sole --joint-topic /icub/joint_states
  leg_fk plot dump/left_leg dump/right_leg -o feet.svg
  leg_fk plot arm.csv -k my_robot.yaml --chains arm"""

_INSTANTS = len(LETTERS)  # at most
_LONGEST_NAME = 50  # characters of a title
_LIKE = 0.02  # so much of the whole movement lower, and an instant is as good as the extreme
_LONGEST_TIME = 1e15  # s
_SPANS_SHOWN = 4


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, 'recordings')
    options.add_output(
        parser,
        'picture to write, .png, .svg or .pdf (default: the name of '
        'RECORDING with .png, in this directory)',
    )
    parser.add_argument(
        '--over',
        metavar='RECORDING',
        nargs='+',
        type=options.path,
        default=(),
        help='another recording, over which the first is drawn',
    )
    parser.add_argument(
        '--orientation',
        action='store_true',
        help='also draw roll, pitch and yaw, which turn a tip from its '
        'orientation at q = 0 about the axes of the root',
    )
    options.add_recording(parser)
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
    name = _name(args.recordings)
    output = f'{Path(name).stem}.png' if args.output is None else args.output
    check_output(output, args.force)
    chains = recorded_chains(args)
    with shown_progress(name) as progress:
        drawn = [each for each in (args.recordings, args.over) if each]
        shares = [0.0] * len(drawn)
        read = []
        for place, recordings in enumerate(drawn):
            part = part_of(progress, shares, place)
            read.append(_tracks(recordings, chains, args, part))
        tracks, *others = read
        over = others[0] if others else []
        instants = (
            _checked_instants(args.at, tracks) if args.at else default_instants(tracks)
        )
        title = _title(args.recordings, tracks)
        if over:
            title += f'   over   {_title(args.over, over)}'
        save_picture(
            lambda: feet_figure(
                tracks,
                instants,
                title,
                over=over,
                over_name=_shown(args.over),
                orientation=args.orientation,
            ),
            output,
            force=args.force,
        )
    counts = Counter[str]()
    for track in tracks:
        counts[track.chain.tip] += track.count
    words = [f'{n} pose{"s" * (n != 1)} of {tip}' for tip, n in counts.items()]
    print(f'{output}: {", ".join(words)}')
    return 0


def _tracks(
    recordings: Sequence[str],
    chains: Sequence[Chain] | Described,
    args: argparse.Namespace,
    progress: Progress | None,
) -> list[ChainTrack]:
    """Return what the chains did, and print what there is to say of it."""
    reading = read_tracks(
        recordings,
        chains,
        args.joint_topics,
        progress,
        time_unit=args.time_unit,
        joint_prefix=args.joint_prefix,
        begin=args.begin,
        end=args.end,
    )
    options.print_notes(reading.warnings, reading.notes)
    return reading.tracks


def default_instants(tracks: Sequence[ChainTrack]) -> list[float]:
    """Return up to four times of samples that are worth drawing [s].

    Of two feet those where one is highest above the other and farthest ahead of it, both ways;
    else, and if the feet hardly move, evenly spaced ones.
    """
    if len(tracks) == 2 and all((np.diff(track.times) >= 0).all() for track in tracks):
        one, two = tracks
        instants = _far_apart(one, two)
        if len(set(instants)) == _INSTANTS:
            return sorted(instants)
    name = tracks[0].chain.name
    times = np.hstack([track.times for track in tracks if track.chain.name == name])
    rows = np.linspace(0, len(times) - 1, _INSTANTS).round().astype(int)
    return sorted({float(time) for time in times[rows]})


def _far_apart(one: ChainTrack, two: ChainTrack) -> list[float]:
    """Return when one foot is highest above the other and farthest ahead of it, both ways [s]."""
    both = np.array([two.covers(time) for time in one.times.tolist()])
    times = one.times[both]
    if not len(times):
        return []
    columns = [np.interp(times, two.times, two.poses[:, i]) for i in range(3)]
    apart = one.poses[both, :3] - np.stack(columns, axis=1)
    above, ahead = apart[:, 2], apart[:, 0]
    start, end = time_span([one, two])
    instants = []
    for i, distance in enumerate((above, ahead, -above, -ahead)):
        # Of a gait's many steps one of the i-th quarter, so that the picture is spread out.
        quarter = start + (end - start) * (i + 0.5) / _INSTANTS
        instants.append(_extreme_near(times, distance, quarter))
    return instants


def _extreme_near(times: Array, distance: Array, near: float) -> float:
    """Return the time [s] nearest to one at which an (N,) distance is as good as largest."""
    is_large = distance >= distance.max() - _LIKE * np.ptp(distance)
    like = times[is_large]
    return float(like[np.abs(like - near).argmin()])


def _checked_instants(
    instants: Sequence[float], tracks: Sequence[ChainTrack]
) -> list[float]:
    """Return the times of the samples that are nearest to some times, in order [s]."""
    found = []
    for instant in instants:
        there = [track for track in tracks if track.covers(instant)]
        if not there:
            raise LegFKError(
                f'--at: found {instant:g} s, where there is no pose; allowed: '
                f'{_spans(tracks)}'
            )
        found.append(float(there[0].times[there[0].nearest(instant)]))
    return sorted(set(found))


def _spans(tracks: Sequence[ChainTrack]) -> str:
    """Return when there are poses, in words."""
    start, end = time_span(tracks)
    gaps = tracks[0].gaps if len(tracks[0].gaps) < _SPANS_SHOWN else []
    begins = [start, *(last for _, last in gaps)]
    ends = [*(first for first, _ in gaps), end]
    return ', '.join(f'{begin:g} to {last:g} s' for begin, last in zip(begins, ends))


def _times(text: str) -> list[float]:
    times = [options.number(word) for word in text.split(',')]
    if len(times) > _INSTANTS or not all(map(math.isfinite, times)):
        raise argparse.ArgumentTypeError(
            f'found {text.strip()!r}, allowed: up to {_INSTANTS} '
            'times in seconds, separated by commas'
        )
    return times


def _name(recordings: Sequence[str]) -> str:
    """Return the name of a recording, or of the first of its parts."""
    return os.path.basename(os.path.realpath(recordings[0]))


def _shown(recordings: Sequence[str]) -> str:
    """Return the name of a recording as a picture can show it."""
    if not recordings:
        return ''
    shown = os.fsencode(_name(recordings)).decode(
        errors='backslashreplace'
    )  # it may be no text
    if len(shown) > _LONGEST_NAME:
        shown = f'{shown[:_LONGEST_NAME]}...'
    others = len(recordings) - 1
    return f'{shown} and {others} more' if others else shown


def _title(recordings: Sequence[str], tracks: Sequence[ChainTrack]) -> str:
    """Return the name of a recording, with the versions of the chains."""
    versions = ', '.join(dict.fromkeys(track.chain.version for track in tracks))
    return f'{_shown(recordings)}   {versions}'
