"""RViz for what a node publishes: the shipped configuration, with its chains and names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from icub_leg_fk.kinematics import Chain, config_file
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import Configuration
import numpy as np
import yaml

_POSE = 'rviz_default_plugins/Pose'
_VIEW = 1.75  # distance of the camera, in sizes of what it looks at
_AXES = 0.2  # length of a tip's axes, likewise


def rviz_config(configuration: Configuration, node: str) -> str:
    """Return a configuration of RViz, which is a YAML file.

    Args:
        configuration: what the node publishes.
        node: full name of the node.
    """
    shipped = yaml.safe_load(config_file('foot_poses.rviz').read_text(encoding='utf-8'))
    manager = shipped['Visualization Manager']
    chains = configuration.chains
    points = _points(chains)
    size = float(np.ptp(points, axis=0).max())
    manager['Displays'] = _displays(
        manager['Displays'], chains, node, round(_AXES * size, 3)
    )
    floor = _named(manager['Displays'], 'Floor')
    floor['Offset']['Z'] = round(float(points[:, 2].min()), 3)
    manager['Global Options']['Fixed Frame'] = (
        configuration.frame_prefix + chains[0].root_frame
    )
    view = manager['Views']['Current']
    view['Distance'] = round(_VIEW * size, 3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    view['Focal Point'] = dict(zip('XYZ', np.round(middle, 3).tolist(), strict=True))
    return yaml.safe_dump(shipped, sort_keys=False)


def _points(chains: Sequence[Chain]) -> Array:
    """Return the (N, 3) origins of the chains' frames and of their root, all joints at 0 [m]."""
    origins = [chain.frames(np.zeros(chain.n))[:, :3, 3] for chain in chains]
    return np.vstack([np.zeros((1, 3)), *origins])


def _displays(
    shipped: Sequence[dict[str, Any]], chains: Sequence[Chain], node: str, length: float
) -> list[dict[str, Any]]:
    """Return the displays, with a pose for each chain, with axes of this length [m]."""
    pose = next(display for display in shipped if display['Class'] == _POSE)
    displays = [display for display in shipped if display['Class'] != _POSE]
    _named(displays, 'Skeleton')['Topic']['Value'] = f'{node}/skeleton'
    for chain in chains:
        topic = pose['Topic'] | {'Value': f'{node}/{chain.tip}/pose'}
        axes = {'Axes Length': length, 'Axes Radius': round(length / 16, 4)}
        displays.append(pose | axes | {'Name': chain.tip, 'Topic': topic})
    return displays


def _named(displays: Sequence[dict[str, Any]], name: str) -> dict[str, Any]:
    [display] = [display for display in displays if display['Name'] == name]
    return display
