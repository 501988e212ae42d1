"""Marker messages that draw a chain as a skeleton, for RViz and Foxglove."""

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

_BONE_WIDTH = 0.012  # m
_JOINT_DIAMETER = 0.03  # m
_SOLE_WIDTH = 0.006  # m
_BONE_COLOR = ColorRGBA(r=0.75, g=0.75, b=0.78, a=1.0)
_JOINT_COLOR = ColorRGBA(r=0.0, g=0.45, b=0.70, a=1.0)
_SOLE_COLOR = ColorRGBA(r=0.90, g=0.60, b=0.0, a=1.0)


def skeleton_markers(chain: Chain, q: Sequence[float], stamp: Time, frame_prefix: str
                     ) -> MarkerArray:
    """Return a line through the origins of the chain's frames, a ball at each, and the sole.

    Args:
        chain: the chain.
        q: n joint positions [rad or m].
        stamp: stamp of the markers.
        frame_prefix: put before the root frame's id.
    """
    origins = [Point(), *_points(chain.frames(q)[:, :3, 3])]
    bones = _line(0, origins, _BONE_WIDTH, _BONE_COLOR)
    balls = Marker(id=1, type=Marker.SPHERE_LIST, color=_JOINT_COLOR, points=origins)
    balls.scale.x = balls.scale.y = balls.scale.z = _JOINT_DIAMETER
    markers = [bones, balls]
    corners = chain.sole_outline(q)
    if corners is not None:
        points = _points(corners)
        markers.append(_line(2, [*points, points[0]], _SOLE_WIDTH, _SOLE_COLOR))
    for marker in markers:
        marker.header = Header(stamp=stamp, frame_id=frame_prefix + chain.root_frame)
        marker.ns = chain.name
        marker.action = Marker.ADD
        marker.pose.orientation.w = 1.0
    return MarkerArray(markers=markers)


def no_skeletons() -> MarkerArray:
    """Return what makes a viewer forget every skeleton, such as those of chains now dropped."""
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def _line(number: int, points: list[Point], width: float, color: ColorRGBA) -> Marker:
    marker = Marker(id=number, type=Marker.LINE_STRIP, color=color, points=points)
    marker.scale.x = width
    return marker


def _points(positions: Array) -> list[Point]:
    """Return (K, 3) positions as messages."""
    return [Point(x=x, y=y, z=z) for x, y, z in positions.tolist()]
