"""How the cost grows, as a picture."""

from __future__ import annotations

import math
from pathlib import Path

from bench.report import Report
from icub_leg_fk.tools.output_file import whole_file

_COLOURS = {'ours': '#1f6fb4', 'floor': '#8a8a8a', 'plain': '#c8553d'}
_LABELS = {
    'ours': 'foot_pose_publisher', 'floor': 'floor: no kinematics', 'plain': 'plain rclpy, numpy'}
_BAG_LABELS = {'ours': 'leg_fk bag', 'plain': 'plain rosbags loop'}
_PANELS = {
    'joints': ('Joints per message, 1 kHz', 'joints', 'CPU per message [µs]', ''),
    'chains': ('Chains, 32 joints, 1 kHz', 'chains', 'CPU per message [µs]', ''),
    'rate': ('Rate, 32 joints, as far as it keeps up', 'messages per second [Hz]',
             'CPU per message [µs]', 'x'),
    'bag': ('Bag at 1 kHz, 32 joints', 'seconds recorded [s]', 'seconds taken [s]', 'xy'),
}


def draw(report: Report, path: Path) -> None:
    """Save the growth curves: medians, with the spread as a band."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot as plt
    from matplotlib.ticker import LogLocator
    plt.rcParams.update({'font.size': 9, 'axes.spines.top': False, 'axes.spines.right': False})
    panels = [panel for panel in _PANELS if panel in report.growth]
    rows = math.ceil(len(panels) / 2)
    fig, all_axes = plt.subplots(rows, 2, figsize=(8.4, 3.1 * rows), squeeze=False,
                                 layout='constrained')
    for unused in all_axes.flat[len(panels):]:
        unused.set_axis_off()
    for axes, panel in zip(all_axes.flat, panels):
        title, xlabel, ylabel, log = _PANELS[panel]
        axes.set_title(title, fontsize=9, loc='left')
        axes.set_xlabel(xlabel)
        axes.set_ylabel(ylabel)
        labels = _BAG_LABELS if panel == 'bag' else _LABELS
        for name in (name for name in _COLOURS if name in report.growth[panel]):
            points = report.growth[panel][name]
            x = [at for at, _ in points]
            axes.plot(x, [value.median for _, value in points], 'o-', markersize=3.5,
                      color=_COLOURS[name], label=labels[name])
            axes.fill_between(x, [value.low for _, value in points],
                              [value.high for _, value in points],
                              color=_COLOURS[name], alpha=0.2, linewidth=0)
        if 'x' in log:
            axes.set_xscale('log')
        if 'y' in log:
            axes.set_yscale('log')
        else:
            axes.set_ylim(bottom=0)
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == 'log':
                axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
                axis.set_major_formatter('{x:g}')
                axis.set_minor_formatter('')
        if panel == 'chains':
            axes.set_xticks([1, 2, 3])
        axes.grid(alpha=0.25, linewidth=0.6)
        axes.legend(frameon=False, fontsize=8)
    fig.suptitle(report.machine, fontsize=8, color='#666666', x=0.01, ha='left')
    with whole_file(path, force=True) as stream:
        fig.savefig(stream, format='png', dpi=150)
    plt.close(fig)
