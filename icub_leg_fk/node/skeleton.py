"""Marker messages that draw a chain as a skeleton, for RViz and Foxglove."""

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

# Sizes [m], where RViz looks for them.
_BONES = Vector3(x=0.012)
_JOINTS = Vector3(x=0.03, y=0.03, z=0.03)
_LETTERS = Vector3(z=0.04)
_SOLE = Vector3(x=0.006)
_NAME_BELOW = 0.08  # m; the middle of the name below the tip
_JOINT_COLOR = ColorRGBA(r=0.75, g=0.75, b=0.78, a=1.0)


def skeleton_markers(
    chain: Chain, q: Sequence[float], stamp: Time, frame_prefix: str
) -> MarkerArray:
    """Return a line through the chain's frames, a ball at each, the tip's name and the sole.

    Args:
        chain: the chain.
        q: n joint positions [rad or m].
        stamp: stamp of the markers.
        frame_prefix: put before the root frame's id.
    """
    color = _color(chain)
    origins = [Point(), *_points(chain.frames(q)[:, :3, 3])]
    bones = Marker(
        type=Marker.LINE_STRIP,
        points=origins,
        scale=_BONES,
        color=color,
    )
    joints = Marker(
        type=Marker.SPHERE_LIST,
        points=origins,
        scale=_JOINTS,
        color=_JOINT_COLOR,
    )
    name = Marker(
        type=Marker.TEXT_VIEW_FACING,
        text=chain.tip,
        scale=_LETTERS,
        color=color,
    )
    tip = origins[-1]
    name.pose.position = Point(x=tip.x, y=tip.y, z=tip.z - _NAME_BELOW)
    markers = [bones, joints, name]
    corners = chain.sole_outline(q)
    if corners is not None:
        points = _points(corners)
        sole = Marker(
            type=Marker.LINE_STRIP,
            points=[*points, points[0]],
            scale=_SOLE,
            color=color,
        )
        markers.append(sole)
    for number, marker in enumerate(markers):
        marker.header = Header(stamp=stamp, frame_id=frame_prefix + chain.root_frame)
        marker.ns = chain.name
        marker.id = number
        marker.action = Marker.ADD
        marker.pose.orientation.w = 1.0
    return MarkerArray(markers=markers)


def no_skeletons() -> MarkerArray:
    """Return what makes a viewer forget every skeleton, such as those of chains now dropped."""
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def _points(positions: Array) -> list[Point]:
    """Return (K, 3) positions as messages."""
    return [Point(x=x, y=y, z=z) for x, y, z in positions.tolist()]


def _color(chain: Chain) -> ColorRGBA:
    red, green, blue = bytes.fromhex(color_of(chain).removeprefix('#'))
    return ColorRGBA(r=red / 255, g=green / 255, b=blue / 255, a=1.0)
