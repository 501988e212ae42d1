"""Make the pictures of the documentation: `python docs/pictures.py DIRECTORY`."""

from pathlib import Path
import sys

from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import Catalog, config_file
from icub_leg_fk.tools.drawing import color_of, FAINT, feet_figure, save_picture, Space
from icub_leg_fk.tools.recording import read_csv
import numpy as np

VERSION = 'v2_5'
LEGS = ('left_leg', 'right_leg')
STANDING = np.radians([8.0, 0.0, 0.0, -16.0, -8.0, 0.0])
CATALOG = Catalog.load()


def walking():
    """Return the feet of the synthetic gait over time."""
    gait = read_csv(config_file('examples/synthetic_walk.csv'),
                    [joint for sole in SOLES.values() for joint in sole.joint_names])
    tracks = [gait.track(SOLES[name]) for name in LEGS]
    return feet_figure(tracks, default_instants(tracks), f'synthetic gait   {VERSION}', SOLES)


def frames():
    """Return a drawing of the axes: of the root on the legs, and of both frames on a foot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.6))
    chains = [CATALOG.chain(name, VERSION, 'dh') for name in LEGS]
    figure.text(0.03, 0.94, chains[0].root_frame, fontsize=15, weight='bold')
    points = np.vstack([chain.frames(STANDING)[:, :3, 3] for chain in chains])
    grid = figure.add_gridspec(2, 2, left=0.0, right=1.0, top=0.94, bottom=0.0, hspace=0.0)
    space = Space(figure, grid[:, 0], points, azimuth=222.0, zoom=1.1)
    for chain in chains[::-1]:
        space.chain(chain, STANDING, 10)
    space.frame(np.eye(4), 0.13, 60, 2.6, ('x backward', 'y right', 'z up'), 12)
    for place, foot_frame, names in (
            (grid[0, 1], 'dh', ('x up', 'y right', 'z toward the toes')),
            (grid[1, 1], 'sole', ('x forward', 'y left', 'z up'))):
        top = 0.94 if foot_frame == 'dh' else 0.46
        tips = [CATALOG.chain(name, VERSION, foot_frame).frame_id for name in LEGS]
        figure.text(0.51, top, ',  '.join(tips), fontsize=15, weight='bold')
        default = ', the default' * (foot_frame == 'dh')
        figure.text(0.51, top - 0.045, f'foot_frame: {foot_frame}{default}', color=FAINT)
        foot(figure, place, CATALOG.chain('left_leg', VERSION, foot_frame), names)
    return figure


def foot(figure, place, chain, names):
    """Draw a left foot from near, with its frame."""
    T = chain.forward(STANDING)
    T[:3, 3] = 0.0
    outline = np.array([(0.05, 0.03, 0.0), (-0.12, -0.1, 0.06)])
    space = Space(figure, place, outline, azimuth=222.0, elevation=24.0, zoom=1.2)
    sole = SOLES['left_leg'].forward(STANDING)[:3, :3]
    corners = [(0.12, 0.04), (0.12, -0.04), (-0.07, -0.04), (-0.07, 0.04)]
    space.fill([sole @ (x, y, 0.0) for x, y in corners], color_of(chain), 5, 0.3)
    space.line([(0.0, 0.0, 0.0), (0.0, 0.0, 0.08)], color=color_of(chain), linewidth=10,
               alpha=0.5, zorder=6)
    space.frame(T, 0.1, 20, 3.0, names, 12)


if __name__ == '__main__':
    directory = Path(sys.argv[1])
    save_picture(walking, directory / 'walking.png', force=True, dpi=115)
    save_picture(frames, directory / 'frames.png', force=True, dpi=115)
