"""Make the pictures of the documentation: `python docs/pictures.py DIRECTORY`."""

from pathlib import Path
import sys

from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import config_file, load_chain
from icub_leg_fk.stream.colors import color_of
from icub_leg_fk.tools.drawing import feet_figure, new_figure, save_picture
from icub_leg_fk.tools.space import Box, FAINT, Space
from icub_leg_fk.tools.tracks import read_tracks
import numpy as np

LEGS = [load_chain(name) for name in ('left_leg', 'right_leg')]
STANDING = np.radians([8.0, 0.0, 0.0, -16.0, -8.0, 0.0])
AXES = {
    'dh': ('x up', 'y right', 'z toward the toes'),
    'sole': ('x forward', 'y left', 'z up'),
}


def walking():
    """Return the feet of the synthetic gait over time."""
    soles = [leg.with_frame('sole') for leg in LEGS]
    tracks = read_tracks([config_file('examples/synthetic_walk.csv')], soles).tracks
    return feet_figure(
        tracks, default_instants(tracks), f'synthetic gait   {LEGS[0].version}'
    )


def frames():
    """Return a drawing of the axes: of the root on the legs, and of both frames on a foot."""
    figure = new_figure(11.0, 6.6)
    figure.text(0.03, 0.94, LEGS[0].root_frame, fontsize=15, weight='bold')
    points = np.vstack([leg.frames(STANDING)[:, :3, 3] for leg in LEGS])
    space = Space(figure, Box(0.2, 0.1, 5.2, 6.1), points, azimuth=222.0)
    for leg in reversed(LEGS):
        space.chain(leg, STANDING, 10)
    space.frame(np.eye(4), 0.1, 60, 2.6, ('x backward', 'y right', 'z up'), 12)
    for row, (name, axes) in enumerate(AXES.items()):
        top = 0.94 - 0.48 * row
        frame_ids = [leg.with_frame(name).frame_id for leg in LEGS]
        default = '' if row else ', the default'
        figure.text(0.51, top, ',  '.join(frame_ids), fontsize=15, weight='bold')
        figure.text(0.51, top - 0.045, f'foot_frame: {name}{default}', color=FAINT)
        box = Box(5.3, 3.3 - 3.2 * row, 5.6, 2.5)
        draw_foot(figure, box, LEGS[0].with_frame(name), axes)
    return figure


def draw_foot(figure, box, leg, axes):
    """Draw a foot from near, with its frame and the names of its axes."""
    T = leg.forward(STANDING)
    sole = leg.sole_outline(STANDING) - T[:3, 3]
    T[:3, 3] = 0.0
    seen = np.array([(0.05, 0.03, 0.0), (-0.12, -0.1, 0.0), (0.0, 0.0, 0.12)])
    space = Space(figure, box, seen, azimuth=222.0, elevation=24.0)
    space.fill(sole, color_of(leg), 5, 0.3)
    space.line(
        [(0.0, 0.0, 0.0), (0.0, 0.0, 0.08)],
        color=color_of(leg),
        linewidth=10,
        alpha=0.5,
        zorder=6,
    )
    space.frame(T, 0.1, 20, 3.0, axes, 12)


if __name__ == '__main__':
    directory = Path(sys.argv[1])
    save_picture(walking, directory / 'walking.png', force=True, dpi=115)
    save_picture(frames, directory / 'frames.png', force=True, dpi=115)
