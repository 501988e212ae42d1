"""Marker messages that draw a chain as a skeleton, for RViz and Foxglove."""

from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

_BONE_WIDTH = 0.012  # m
_JOINT_DIAMETER = 0.03  # m
_BONE_COLOR = ColorRGBA(r=0.75, g=0.75, b=0.78, a=1.0)
_JOINT_COLOR = ColorRGBA(r=0.0, g=0.45, b=0.70, a=1.0)
_SOLE_COLOR = ColorRGBA(r=0.90, g=0.60, b=0.0, a=1.0)
_SOLE_WIDTH = 0.006  # m


def skeleton_markers(chain: Chain, q: Sequence[float], stamp: Time, frame_prefix: str
                     ) -> MarkerArray:
    """Return a line through the origins of the chain's frames, a ball at each, and the sole.

    Args:
        chain: the chain.
        q: n joint positions [rad or m].
        stamp: stamp of the markers.
        frame_prefix: put before the root frame's id.
    """
    points = [Point(), *_points(chain.frames(q)[:, :3, 3])]
    bones = _marker(chain, stamp, frame_prefix, 0, Marker.LINE_STRIP, _BONE_WIDTH, _BONE_COLOR)
    joints = _marker(chain, stamp, frame_prefix, 1, Marker.SPHERE_LIST, _JOINT_DIAMETER,
                     _JOINT_COLOR)
    bones.points = joints.points = points
    markers = [bones, joints]
    corners = chain.sole_outline(q)
    if corners is not None:
        outline = _marker(chain, stamp, frame_prefix, 2, Marker.LINE_STRIP, _SOLE_WIDTH,
                          _SOLE_COLOR)
        outline.points = _points([*corners, corners[0]])
        markers.append(outline)
    return MarkerArray(markers=markers)


def no_skeletons() -> MarkerArray:
    """Return what makes a viewer forget every skeleton, such as those of chains now dropped."""
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def _points(positions: Iterable[Array]) -> list[Point]:
    """Return positions, (3,) each, as messages."""
    return [Point(x=x, y=y, z=z) for x, y, z in (position.tolist() for position in positions)]


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
