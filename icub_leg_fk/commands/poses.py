"""`leg_fk poses`: the poses of a recording as numbers, for a spreadsheet, pandas or numpy."""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
import sys

from icub_leg_fk.tools import options
from icub_leg_fk.tools.output_file import check_target, STANDARD_OUTPUT, whole_path
from icub_leg_fk.tools.pose_table import (
    column_names,
    CsvTable,
    NpzTable,
    PoseTable,
    Sink,
)
from icub_leg_fk.tools.progress import shown_progress
from icub_leg_fk.tools.recorded_robot import recorded_chains
from icub_leg_fk.tools.recording import follow, open_recording, warnings_of

EXAMPLES = """\
RECORDING is a rosbag2 bag (directory, .mcap or .db3), a CSV file with a column of times and one
per joint in radians, or a directory of yarpdatadumper; several of them are parts of one robot.
There is a row per time at which a chain has a pose, with the same numbers as those of leg_fk bag:
time, and x, y, z [m], qx, qy, qz, qw of each tip in the root frame; empty where it has none.

examples:
  leg_fk poses walking > feet.csv
  leg_fk poses walking.csv -o feet.npz
  leg_fk poses walking -o legs.csv --description-from-topic --chains l_sole --root base_link
  leg_fk poses walking.mcap -o feet.csv --twist --version v1 --foot-frame sole
  leg_fk poses dump/torso dump/head --chains head_imu=v2
  leg_fk poses walking --joint-topic /icub/left_leg/joint_states /icub/right_leg/joint_states"""

_FORMATS = ('.csv', '.npz')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, 'recordings')
    options.add_output(
        parser, 'file to write, .csv or .npz (default: CSV to standard output)'
    )
    options.add_recording(parser)
    parser.add_argument(
        '--twist',
        action='store_true',
        help='also vx, vy, vz [m/s], wx, wy, wz [rad/s], from joint velocities',
    )


def run(args: argparse.Namespace) -> int:
    """Write the table."""
    if args.output not in (None, STANDARD_OUTPUT):
        check_target(args.output, force=args.force, endings=_FORMATS)
    name = Path(args.recordings[0]).name
    with (
        shown_progress(name) as progress,
        open_recording(
            args.recordings,
            recorded_chains(args),
            args.joint_topics,
            args.time_unit,
            args.joint_prefix,
        ) as recording,
    ):
        chains = recording.robot.periods[0].chains
        columns = column_names(chains, args.twist)
        with _sink(args.output, columns, args.force) as sink:
            table = PoseTable(chains, args.twist, sink)
            look = follow(
                recording, table.take, velocities=args.twist, progress=progress
            )
            table.finish()
            poseless = [name for name, count in table.counts.items() if not count]
            warnings = warnings_of(recording, look, poseless)
    options.print_notes(warnings, recording.notes)
    if args.output not in (None, STANDARD_OUTPUT):
        counts = ', '.join(
            f'{table.counts[chain.name]} poses of {chain.tip}' for chain in chains
        )
        print(f'{args.output}: {table.rows} rows, {counts}')
    return 0


@contextmanager
def _sink(output: str | None, columns: Sequence[str], force: bool) -> Iterator[Sink]:
    """Give what takes the rows of the table; a file takes its place when the block ends well."""
    if output is None or output == STANDARD_OUTPUT:
        yield CsvTable(sys.stdout, columns)
        return
    with whole_path(output, force=force) as place:
        if Path(output).suffix.lower() == '.csv':
            with place.open('w', encoding='utf-8') as stream:
                yield CsvTable(stream, columns)
            return
        with closing(NpzTable(columns, place.parent)) as table:
            yield table
            table.save(place)
