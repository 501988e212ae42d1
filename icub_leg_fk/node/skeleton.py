"""Marker messages that draw a chain as a skeleton, for RViz and Foxglove."""

from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

_BONE_WIDTH = 0.012  # m
_JOINT_DIAMETER = 0.03  # m
_SOLE_WIDTH = 0.006  # m
_JOINT_COLOR = ColorRGBA(r=0.75, g=0.75, b=0.78, a=1.0)
_NAME_HEIGHT, _NAME_BELOW = 0.04, 0.08  # m; of the letters, and of their middle below the tip


def skeleton_markers(chain: Chain, q: Sequence[float], stamp: Time, frame_prefix: str
                     ) -> MarkerArray:
    """Return a line through the chain's frames, a ball at each, the tip's name and the sole.

    Args:
        chain: the chain.
        q: n joint positions [rad or m].
        stamp: stamp of the markers.
        frame_prefix: put before the root frame's id.
    """
    color = _color(chain)
    points = [Point(), *_points(chain.frames(q)[:, :3, 3])]
    bones = _marker(chain, stamp, frame_prefix, 0, Marker.LINE_STRIP, _BONE_WIDTH, color)
    joints = _marker(chain, stamp, frame_prefix, 1, Marker.SPHERE_LIST, _JOINT_DIAMETER,
                     _JOINT_COLOR)
    bones.points = joints.points = points
    name = _marker(chain, stamp, frame_prefix, 3, Marker.TEXT_VIEW_FACING, 0.0, color)
    name.text = chain.tip
    name.scale.z = _NAME_HEIGHT
    tip = points[-1]
    name.pose.position = Point(x=tip.x, y=tip.y, z=tip.z - _NAME_BELOW)
    markers = [bones, joints, name]
    corners = chain.sole_outline(q)
    if corners is not None:
        outline = _marker(chain, stamp, frame_prefix, 2, Marker.LINE_STRIP, _SOLE_WIDTH, color)
        outline.points = _points([*corners, corners[0]])
        markers.append(outline)
    return MarkerArray(markers=markers)


def no_skeletons() -> MarkerArray:
    """Return what makes a viewer forget every skeleton, such as those of chains now dropped."""
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def _points(positions: Iterable[Array]) -> list[Point]:
    """Return positions, (3,) each, as messages."""
    points = []
    for position in positions:
        x, y, z = position.tolist()
        points.append(Point(x=x, y=y, z=z))
    return points


def _color(chain: Chain) -> ColorRGBA:
    red, green, blue = bytes.fromhex(color_of(chain).removeprefix('#'))
    return ColorRGBA(r=red / 255, g=green / 255, b=blue / 255, a=1.0)


def _marker(chain: Chain, stamp: Time, frame_prefix: str, number: int, kind: int, size: float,
            color: ColorRGBA) -> Marker:
    marker = Marker(ns=chain.name, id=number, type=kind, action=Marker.ADD, color=color)
    marker.header.frame_id = frame_prefix + chain.root_frame
    marker.header.stamp = stamp
    marker.pose.orientation.w = 1.0
    marker.scale.x = size
    if kind == Marker.SPHERE_LIST:
        marker.scale.y = marker.scale.z = size
    return marker
