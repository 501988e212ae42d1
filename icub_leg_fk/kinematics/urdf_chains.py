"""The chains of a URDF by name, each made when it is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
import math

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.chain import Chain, TipFrame
from icub_leg_fk.kinematics.kinematics_file import ChainEntry
from icub_leg_fk.kinematics.rotation import angle_between
from icub_leg_fk.kinematics.table_from_urdf import chain_from_urdf, VERSION
from icub_leg_fk.kinematics.urdf_file import JointElement, Urdf, UrdfJoint
import numpy as np

_SAME_AXES = 0.1  # rad
_LARGEST_ANGLE = 2 * math.pi + 1e-3  # rad
_LARGEST_LENGTH = 10.0  # m
_LIMIT_IN_DEGREES = (
    4 * math.pi + 1e-3,
    720.0,
)  # whole numbers between are hardly radians


class UrdfChains(Mapping[str, ChainEntry]):
    """Chains from the root of a URDF to its links, in the one version `urdf`.

    Known chains, such as `left_leg`, go by their own names where the robot has their root, their
    joints on the way and one of their tip frames; of those it has the first is the default. Every
    other link below the root with a joint between is a chain of the link's name. Going through
    the names gives the known chains and the links at the ends, not those in between.

    Args:
        urdf: the robot.
        root: the link to start from.
        known: the known chains.
        tolerance: see `chain_from_urdf`; 0 for exact tables.
    """

    def __init__(
        self,
        urdf: Urdf,
        root: str,
        known: Mapping[str, ChainEntry],
        tolerance: float = 0.0,
    ) -> None:
        self._urdf = urdf
        self._root = root
        self._known = dict(known)
        self._tolerance = tolerance
        self._made: dict[str, ChainEntry] = {}

    def __getitem__(self, name: str) -> ChainEntry:
        if name not in self._made:
            self._made[name] = self._entry(name)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.known()
        for link in self._urdf.ends():
            if self._moves(link):
                yield link

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def known(self) -> dict[str, str]:
        """Return the tips of the known chains that the robot has, by chain."""
        entries = self._known.values()
        return {
            entry.name: entry.tip for entry in entries if self._known_frames(entry.name)
        }

    def _entry(self, name: str) -> ChainEntry:
        frames = self._known_frames(name)
        if frames:
            chain = self._known_chain(name, frames)
        elif name in self._urdf.links:
            chain = self._chain(name)
        else:
            raise KeyError(name)
        return ChainEntry(name, chain.tip, {VERSION: chain}, VERSION)

    def _known_chain(self, name: str, frames: Mapping[str, TipFrame]) -> Chain:
        """Return a known chain with the robot's own geometry."""
        first = next(iter(frames.values()))
        chain = self._chain(first.frame_id)
        tip_frames = {}
        for name_of_frame, tip_frame in frames.items():
            T = self._urdf.forward(first.frame_id, tip_frame.frame_id, {})[0]
            expected = np.linalg.inv(first.T_tip_frame) @ tip_frame.T_tip_frame
            is_flat = angle_between(T[:3, :3], expected[:3, :3]) < _SAME_AXES
            outline = tip_frame.outline if is_flat else None
            tip_frames[name_of_frame] = TipFrame(tip_frame.frame_id, T, outline)
        return replace(
            chain, name=name, tip=self._known[name].tip, tip_frames=tip_frames, frame=''
        )

    def _chain(self, link: str) -> Chain:
        return chain_from_urdf(self._urdf, self._root, link, tolerance=self._tolerance)

    def _known_frames(self, name: str) -> dict[str, TipFrame]:
        """Return the tip frames of a known chain that the robot has, all on one body."""
        if name not in self._known:
            return {}
        for table in self._known[name].versions.values():
            frames: dict[str, TipFrame] = {}
            joints: list[str] = []
            for frame, tip_frame in table.tip_frames.items():
                found = self._moving_joints(table.root_frame, tip_frame.frame_id)
                if not {*table.joint_names} <= {*found}:
                    continue
                if not frames:
                    joints = found
                if found == joints:
                    frames[frame] = tip_frame
            if frames:
                return frames
        return {}

    def _moving_joints(self, root: str, link: str) -> list[str]:
        if root != self._root or link not in self._urdf.links:
            return []
        return [joint.moved_by for joint in self._path(link) if joint.moves]

    def _moves(self, link: str) -> bool:
        return any(joint.moves for joint in self._path(link))

    def _path(self, link: str) -> tuple[UrdfJoint, ...]:
        """Return the way to a link; nothing if a table cannot describe it."""
        try:
            return self._urdf.path(self._root, link)
        except LegFKError:
            return ()


def doubts(urdf: Urdf) -> tuple[str, ...]:
    """Return what can be computed with but can hardly be meant, one line each: degrees and mm."""
    joints_by_doubt: dict[str, list[str]] = {}
    for joint in urdf.joints:
        for kind, doubt in _doubts_of_joint(joint).items():
            joints_by_doubt.setdefault(kind, []).append(f'joint {joint.name}: {doubt}')
    lines = []
    for found in joints_by_doubt.values():
        others = len(found) - 1
        more = ''
        if others:
            more = f' (and {others} more joint{"s" * (others != 1)} like this)'
        lines.append(f'{urdf.file}: {found[0]}{more}')
    return tuple(lines)


def _doubts_of_joint(joint: JointElement) -> dict[str, str]:
    """Return what is doubtful in a joint, by kind."""
    found = {}
    rpy, xyz = (joint.texts.get(('origin', key), '') for key in ('rpy', 'xyz'))
    if any(abs(angle) > _LARGEST_ANGLE for angle in _numbers(rpy)):
        found['rpy'] = f'an rpy of {rpy} is unlikely; it is in rad'
    if any(abs(length) > _LARGEST_LENGTH for length in _numbers(xyz)):
        found['xyz'] = f'an xyz of {xyz} is unlikely; it is in m'
    limits = [
        *_numbers(joint.texts.get(('limit', 'lower'), '')),
        *_numbers(joint.texts.get(('limit', 'upper'), '')),
    ]
    low, high = _LIMIT_IN_DEGREES
    in_degrees = [
        f'{limit:g}'
        for limit in limits
        if low < abs(limit) <= high and limit == round(limit)
    ]
    if joint.kind == 'revolute' and in_degrees:
        found['limit'] = (
            f'a limit of {" and ".join(in_degrees)} is unlikely; it is in rad'
        )
    return found


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []
