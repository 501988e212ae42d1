"""The README's pictures: `python -m icub_leg_fk.tools.drawing.docs DIRECTORY`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.drawing import legs as legs
from icub_leg_fk.tools.drawing.pictures import feet_figure, walk_figure
from icub_leg_fk.tools.drawing.style import color_of, FAINT, save_picture
from icub_leg_fk.tools.gait import PERIOD, walk
from icub_leg_fk.tools.plot import telling_instants
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VERSION = 'v2_5'
DPI = 115
LEGS = ('left_leg', 'right_leg')
STANDING = np.radians([8.0, 0.0, 0.0, -16.0, -8.0, 0.0])


def frames_figure(catalog: Catalog) -> Figure:
    """Return a drawing of the axes: of the root on the legs, and both kinds on a foot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.6))
    chains = [catalog.chain(name, VERSION, 'dh') for name in LEGS]
    figure.text(0.03, 0.94, chains[0].root_frame, fontsize=15, weight='bold')
    view = legs.View(figure.add_axes((0.0, 0.0, 0.47, 0.92)), azimuth=222.0)
    low = chains[0].forward(STANDING)[2, 3]
    legs.draw_ground(view, low, legs.grid_lines(-0.3, 0.1), legs.grid_lines(-0.2, 0.2))
    legs.draw_forward(view, (-0.12, -0.2, low))
    for chain, near in zip(chains, (20.0, 10.0), strict=True):
        legs.draw_leg(view, chain, STANDING, True, near)
    legs.draw_triad(view, np.eye(4), 0.13, 3.0, 60, ('x  backward', 'y  right', 'z  up'))
    view.axes.margins(0.03, 0.07)
    for bottom, foot_frame, axes in (
            (0.5, 'dh', ('x  up', 'y  right', 'z  toward the toes')),
            (0.0, 'sole', ('x  forward', 'y  left', 'z  up'))):
        names = [catalog.chain(name, VERSION, foot_frame).tip_frame for name in LEGS]
        default = ', the default' * (foot_frame == 'dh')
        figure.text(0.51, bottom + 0.44, ',  '.join(names), fontsize=15, weight='bold')
        figure.text(0.51, bottom + 0.395, f'foot_frame: {foot_frame}{default}', color=FAINT)
        view = legs.View(figure.add_axes((0.5, bottom, 0.48, 0.355)), azimuth=222.0,
                         elevation=24.0)
        _draw_foot(view, catalog.chain(LEGS[0], VERSION, foot_frame), axes)
    return figure


def _draw_foot(view: legs.View, chain: Chain, axes: tuple[str, str, str]) -> None:
    """Draw a left foot from near, with its frame."""
    T = chain.forward(STANDING)
    color, low = color_of(chain), T[2, 3]
    legs.draw_ground(view, low, legs.grid_lines(-0.2, 0.1), legs.grid_lines(-0.2, 0.0))
    legs.draw_forward(view, (-0.02, -0.2, low), 0.1)
    ankle: Array = chain.frames(STANDING)[-3, :3, 3]
    view.axes.fill(*view.project(legs.sole_outline(T)).T, facecolor=color, alpha=0.3, zorder=5)
    view.line([ankle, T[:3, 3]], color=color, linewidth=10, alpha=0.5, zorder=6)
    legs.draw_triad(view, T, 0.1, 3.4, 20, axes)
    view.axes.margins(0.02, 0.1)


def main() -> None:
    """Draw the pictures into the directory given."""
    parser = argparse.ArgumentParser(prog='python -m icub_leg_fk.tools.drawing.docs',
                                     description="Draws the README's pictures anew.")
    parser.add_argument('directory', metavar='DIRECTORY', type=Path)
    directory = parser.parse_args().directory
    catalog = Catalog.load()
    chains = [catalog.chain(name, VERSION, 'sole') for name in LEGS]
    tracks = [walk(catalog, VERSION, 5.0).track(chain) for chain in chains]
    paths = [track.poses for track in tracks]
    instants = [PERIOD + instant for instant in telling_instants(tracks)]
    title = f'Walking iCub, legs {VERSION}'
    save_picture(lambda: feet_figure(tracks, instants, title, LEGS),
                 directory / 'walking.png', DPI)
    save_picture(lambda: walk_figure(tracks, paths, title, LEGS), directory / 'legs.png', DPI)
    save_picture(lambda: frames_figure(catalog), directory / 'frames.png', DPI)


if __name__ == '__main__':
    main()
