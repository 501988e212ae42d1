"""What all pictures share: colours, type, and how they are written to a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, MissingDependencyError, OutputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.tools.output_file import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ('.png', '.svg', '.pdf')
AXIS_COLORS = ('#d62728', '#2ca02c', '#1f5fd0')  # x red, y green, z blue, as documented
LEFT, RIGHT = '#6a3d9a', '#e08214'  # told apart in every kind of colour vision, and from the axes
OTHERS = ('#00798c', '#8c6d31', '#a8437c')
INK, FAINT, GRID = '#222222', '#8a8a8a', '#e4e4e4'
MINUS = '\N{MINUS SIGN}'  # as wide as the plus, and as matplotlib writes it
SLIDE = (13.333, 7.5)  # inches, 16:9

_SETTINGS = {
    'font.family': 'sans-serif', 'font.sans-serif': ['DejaVu Sans'], 'font.size': 12,
    'axes.titlesize': 12, 'axes.titleweight': 'bold', 'axes.titlelocation': 'left',
    'axes.labelsize': 12, 'axes.labelcolor': INK, 'axes.edgecolor': FAINT,
    'axes.linewidth': 0.8, 'axes.spines.top': False, 'axes.spines.right': False,
    'axes.grid': True, 'axes.axisbelow': True, 'grid.color': GRID, 'grid.linewidth': 0.8,
    'xtick.color': FAINT, 'ytick.color': FAINT, 'xtick.labelcolor': INK, 'ytick.labelcolor': INK,
    'text.color': INK, 'lines.linewidth': 2.0, 'lines.solid_capstyle': 'round',
    'legend.frameon': False, 'figure.dpi': 100, 'svg.fonttype': 'path', 'svg.hashsalt': 'leg_fk',
}


def color_of(chain: Chain) -> str:
    """Return a chain's colour: one for everything left, one for everything right."""
    for word, color in (('left', LEFT), ('right', RIGHT)):
        if word in chain.tip or word in chain.name:
            return color
    return OTHERS[sum(map(ord, chain.name)) % len(OTHERS)]


def has_known_axes(chain: Chain) -> bool:
    """Tell whether the chain's root is known to have x backward, y to the right and z up."""
    return chain.root_frame == 'root_link'


def label_of(chain: Chain) -> str:
    """Return what to call a chain's tip: `left foot`."""
    return chain.tip.replace('_', ' ')


def check_output(path: Path, force: bool) -> None:
    """Refuse a picture that cannot be, before any work is done for it.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        OutputFileError: its format is unknown, it exists and `force` is not set, or its
            directory does not exist.
    """
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            'pictures need matplotlib: pip install matplotlib (rosdep key python3-matplotlib)'
        ) from error
    if path.suffix.lower() not in FORMATS:
        raise OutputFileError(f'{path}: found {path.suffix or "no ending"}, allowed: '
                              f'{", ".join(FORMATS)}')
    if not path.parent.is_dir():
        raise OutputFileError(f'{path}: found no directory {path.parent}, allowed: an existing '
                              'one')
    if path.is_dir() or (path.exists() and not force):
        raise OutputFileError(f'{path}: found a {"directory" if path.is_dir() else "file"} of '
                              'that name, allowed: a new name, or --force to replace a file')


def save_picture(draw: Callable[[], Figure], path: Path, dpi: int = 150) -> None:
    """Draw a picture in the common style and write it, whole or not at all.

    Args:
        draw: returns the figure.
        path: file to write or replace, good by `check_output`.
        dpi: pixels per inch of a PNG.

    Raises:
        OutputFileError: the file cannot be written.
    """
    from matplotlib import rc_context

    kind = path.suffix.lower().lstrip('.')
    # Without dates the same picture is the same file.
    metadata = {'svg': {'Date': None}, 'pdf': {'CreationDate': None}}.get(kind)
    try:
        with (whole_file(path, force=True) as stream,
              rc_context(_SETTINGS)):  # type: ignore[arg-type]
            draw().savefig(stream, format=kind, dpi=dpi, metadata=metadata)
    except ValueError as error:
        raise LegFKError(f'{path}: cannot be drawn: {error}') from error
