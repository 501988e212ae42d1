"""RViz for what a node publishes: the shipped configuration, with its chains and names."""

from __future__ import annotations

from collections.abc import Sequence

from icub_leg_fk.kinematics import Catalog, Chain, config_file
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.kinematics.table_from_urdf import topic_name
from icub_leg_fk.stream.configuration import Configuration
import numpy as np
import yaml

_VIEW = 1.75  # distance of the camera, in sizes of what it looks at
_AXES = 0.2  # length of a tip's axes, likewise


def rviz_config(configuration: Configuration, node: str, root_frame: str = '') -> str:
    """Return a configuration of RViz, which is a YAML file.

    Args:
        configuration: what the node publishes.
        node: full name of the node.
        root_frame: root link of a description that is still to come; `root_link` if empty. How
            large its robot is nobody knows, so that it is looked at as the shipped one is.
    """
    shipped = yaml.safe_load(config_file('foot_poses.rviz').read_text(encoding='utf-8'))
    manager = shipped['Visualization Manager']
    displays = {display['Name']: display for display in manager['Displays']}
    pose = displays.pop('left_foot')
    displays.pop('right_foot')
    tips = [_tip(name) for name in configuration.awaited]
    root = root_frame or 'root_link'
    if configuration.chains:
        tips = [chain.tip for chain in configuration.chains]
        root = configuration.chains[0].root_frame
        low, high = _corners(configuration.chains)
        size = float((high - low).max())
        length = round(_AXES * size, 3)
        pose |= {'Axes Length': length, 'Axes Radius': round(length / 16, 4)}
        displays['Floor']['Offset']['Z'] = _rounded(low)['Z']
        view = manager['Views']['Current']
        view['Distance'] = round(_VIEW * size, 3)
        view['Focal Point'] = _rounded((low + high) / 2)
    manager['Global Options']['Fixed Frame'] = configuration.frame_prefix + root
    displays['Skeleton']['Topic']['Value'] = f'{node}/skeleton'
    manager['Displays'] = list(displays.values())
    for tip in tips:
        topic = pose['Topic'] | {'Value': f'{node}/{tip}/pose'}
        manager['Displays'].append(pose | {'Name': tip, 'Topic': topic})
    return yaml.safe_dump(shipped, sort_keys=False)


def _tip(name: str) -> str:
    """Return the tip of a chain of a description, as the node names it in topics."""
    shipped = Catalog.load()
    chain, _ = shipped.split(name)
    return shipped.chains[chain].tip if chain in shipped.chains else topic_name(chain)


def _corners(chains: Sequence[Chain]) -> tuple[Array, Array]:
    """Return between which corners the chains and their root are, all joints at 0 [m]."""
    origins = [chain.frames(np.zeros(chain.n))[:, :3, 3] for chain in chains]
    points = np.vstack([np.zeros((1, 3)), *origins])
    return points.min(axis=0), points.max(axis=0)


def _rounded(point: Array) -> dict[str, float]:
    """Return a point to the millimetre, as RViz has it."""
    return dict(zip('XYZ', np.round(point, 3).tolist(), strict=True))
