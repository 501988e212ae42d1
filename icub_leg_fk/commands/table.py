"""`leg_fk table`: the Denavit-Hartenberg tables of a robot from its URDF, as a kinematics file."""

import argparse
import math
from pathlib import Path
import re
import sys
import tempfile

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, chain_from_urdf, DHLink, Urdf
from icub_leg_fk.kinematics.chain_text import short
from icub_leg_fk.kinematics.rotation import angle_between, Array
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel
from icub_leg_fk.tools import options
from icub_leg_fk.tools.output_file import check_target, write_text
import numpy as np

EXAMPLES = """\
Carries out the documented method on a URDF: z axes, origins, x axes, y axes, DH parameters,
product. Each tip becomes a chain; the file has joint names, limits as ranges, T_Ro0, rows, T_nIs
and frame ids. It ends with a comparison of the file with the URDF multiplied out.

examples:
  leg_fk table icub.urdf --root root_link --tips l_sole r_sole -o my_icub.yaml
  leg_fk table panda.urdf --root panda_link0 --tips panda_link8 --convention modified
  leg_fk pose l_sole -k my_icub.yaml --version urdf --degrees 0 10 0 -30 -15 5
  leg_fk explain l_sole -k my_icub.yaml --version urdf"""

VERSION = 'urdf'
_SAMPLES = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('urdf', metavar='ROBOT.urdf', help='the URDF; of a xacro file make one '
                        'first: xacro FILE > robot.urdf')
    parser.add_argument('--root', metavar='LINK', required=True, help='link to start from')
    parser.add_argument('--tips', metavar='LINK', nargs='+', required=True,
                        help='links below it, a chain each')
    parser.add_argument('--name', metavar='NAME', nargs='+',
                        help='names of the chains (default: those of the tips)')
    parser.add_argument('--convention', metavar='{standard,modified}', default='standard',
                        choices=('standard', 'modified'),
                        help="of the table: standard (the default), or modified, which is Craig's")
    parser.add_argument('--tolerance', metavar='RAD', default=1e-4,
                        type=options.number_between(0, 0.1, '0 to 0.1 rad'),
                        help='angle between axes up to which they are taken as parallel, since '
                             'URDFs are rounded (default: 1e-4); what it cost is said')
    options.add_output(parser, 'file to write (default: standard output)')


def run(args: argparse.Namespace) -> int:
    """Write the kinematics file."""
    if args.output is not None:
        check_target(args.output, force=args.force)
    urdf = Urdf.load(args.urdf)
    names = args.name or [_word(tip) for tip in args.tips]
    if len(names) != len(args.tips) or len(set(names)) != len(names):
        raise LegFKError(f'--name: {", ".join(names)}; allowed: {len(args.tips)} different names, '
                         'one per tip')
    chains = [chain_from_urdf(urdf, args.root, tip, name=name, version=VERSION,
                              convention=args.convention, tolerance=args.tolerance)
              for name, tip in zip(names, args.tips)]
    text = table_text(urdf, chains, args.tolerance)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / 'table.yaml'
        file.write_text(text, encoding='utf-8')
        try:
            catalog = Catalog.load(file)
        except LegFKError as error:
            raise LegFKError(f'{args.urdf}: cannot be written as a kinematics file: '
                             f'{str(error).partition(": ")[2]}') from error
    lines = []
    for chain in chains:
        metres, radians = largest_difference(catalog.chain(chain.name, VERSION), urdf)
        lines.append(f'{chain.name}: {chain.n} joints; largest difference from the URDF in '
                     f'{_SAMPLES} postures: {metres:.1g} m, {radians:.1g} rad')
        lines += [f'  taken as parallel: the axes of {one} and {two}, {angle:.1g} rad apart'
                  for one, two, angle in almost_parallel(urdf, args.root, chain.frame_id,
                                                         args.tolerance)]
        lines += [f'  {len(chain.links) - chain.n} fixed rows between axes that are almost '
                  'parallel'] if len(chain.links) > chain.n else []
    write_text(args.output, text, force=args.force)
    if args.output is not None:
        lines.insert(0, f'{args.output}: {", ".join(names)}')
    print('\n'.join(lines), file=sys.stderr if args.output is None else sys.stdout)
    return 0


def largest_difference(chain: Chain, urdf: Urdf) -> tuple[float, float]:
    """Return how far a chain is from a URDF at most, of seeded random postures [m, rad]."""
    rng = np.random.default_rng(2955)
    lower = np.where(np.isfinite(chain.lower), chain.lower, -math.pi)
    upper = np.where(np.isfinite(chain.upper), chain.upper, math.pi)
    Q = rng.uniform(lower, upper, (_SAMPLES, chain.n))
    ours = chain.forward(Q)
    theirs = urdf.forward(chain.root_frame, chain.frame_id,
                          dict(zip(chain.joint_names, Q.T, strict=True)))
    off = np.linalg.norm(ours[:, :3, 3] - theirs[:, :3, 3], axis=1)
    return float(off.max()), float(angle_between(ours[:, :3, :3], theirs[:, :3, :3]).max())


def table_text(urdf: Urdf, chains: list[Chain], tolerance: float) -> str:
    """Return chains of a URDF as the text of a kinematics file."""
    lines = [f'# Denavit-Hartenberg tables of {_comment(urdf.name) or "a robot"}, made by '
             f'`leg_fk table` from {_comment(Path(urdf.file).name)}.',
             f'# Axes that are {tolerance:g} rad apart or less were taken as parallel.', '',
             'units: {length: mm, angle: deg}', '', 'chains:']
    for chain in chains:
        lines += ['', *_chain_lines(chain, urdf)]
    return '\n'.join(lines) + '\n'


def _chain_lines(chain: Chain, urdf: Urdf) -> list[str]:
    rows = tuple(row.link for row in chain.rows())
    lines = [f'  {chain.name}:', f'    tip: {_word(chain.name)}',
             f'    root_frame: {chain.root_frame}',
             f'    joints: [{", ".join(chain.joint_names)}]',
             f'    tip_frames: {{{_word(chain.frame_id)}: {{frame: {chain.frame_id}}}}}',
             '    versions:', f'      {VERSION}:',
             f'        source: "{_comment(Path(urdf.file).name)}"']
    if chain.convention == 'modified':
        lines.append('        convention: modified')
    lines += ['        T_Ro0:', *_matrix_lines(chain.T_root_0), '        links:']
    lines += [f'          - {{{cells}}}' for cells in _row_lines(rows)]
    return [*lines, '        T_nIs:', *_matrix_lines(chain.T_n_tip)]


def _row_lines(rows: tuple[DHLink, ...]) -> list[str]:
    """Return the rows, their cells under each other."""
    cells = []
    for row in rows:
        scale = 1000.0 if row.is_prismatic else 180 / math.pi
        lower, upper = row.limits
        more = ''
        if not row.is_fixed and (lower, upper) != (-math.inf, math.inf):
            more += f', range: [{short(scale * lower, 9)}, {short(scale * upper, 9)}]'
        if row.joint_type != 'revolute':
            more += f', type: {row.joint_type}'
        if row.gain != 1.0:
            more += f', gain: {row.gain:.17g}'
        cells.append((short(1000 * row.a, 10), short(1000 * row.d, 10),
                      short(math.degrees(row.alpha), 13),
                      short(math.degrees(row.offset), 13), more))
    widths = [max(map(len, column)) for column in zip(*cells)]
    return [f'a: {a:>{widths[0]}}, d: {d:>{widths[1]}}, alpha: {alpha:>{widths[2]}}, '
            f'offset: {offset:>{widths[3]}}{more}' for a, d, alpha, offset, more in cells]


def _matrix_lines(T: Array) -> list[str]:
    rows = [[short(value, 16) for value in row[:3]] + [short(1000 * row[3], 10)]
            for row in T.tolist()]
    rows[3][3] = '1'
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ['          - [' + ', '.join(
        f'{value:>{width}}' for value, width in zip(row, widths)) + ']' for row in rows]


def _word(name: str) -> str:
    """Return a name as one of topics and parameters."""
    word = re.sub('[^A-Za-z0-9_]', '_', name)
    return word if word[:1].isalpha() else f'chain_{word}'


def _comment(text: str) -> str:
    return re.sub(r'[^ -!#-\[\]-~]', '_', text)[:200]
