"""What the joint input is held to: its rules in the plainest words, and a naive CDR writer.

Nothing here is shared with the code under test.
"""

from collections import Counter
from dataclasses import dataclass
import math
import struct

LARGEST = 1e150

CATALOG = """
units: {length: m, angle: rad}
chains:
  arm:
    tip: hand
    root_frame: base
    joints: [turn, lift, reach]
    tip_frames: {dh: {frame: hand}}
    versions:
      a:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0, d: 0.4, alpha: 0, offset: 0, range: [-1, 1]}
          - {a: 0, d: 0, alpha: -1.5, offset: 0, type: prismatic, range: [0, 0.5]}
          - {a: 0, d: 0, alpha: 0, offset: 0, type: prismatic}
  camera:                     # shares a joint with the arm, in a range of its own
    tip: eye
    root_frame: base
    joints: [tilt, turn]
    tip_frames: {dh: {frame: eye}}
    versions:
      a:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0.1, d: 0, alpha: 1.5, offset: 0}
          - {a: 0.1, d: 0, alpha: 0, offset: 0, range: [-2, 0.5]}
  pointer:                    # one joint, which is the arm's too
    tip: needle
    root_frame: base
    joints: [lift]
    tip_frames: {dh: {frame: needle}}
    versions:
      a:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0.2, d: 0, alpha: 0, offset: 0, range: [0, 0]}
"""


@dataclass(frozen=True)
class Message:
    """A JointState as its publisher means it; `extra` bytes trail it, `padding` fills its gaps."""

    sec: int
    nanosec: int
    names: tuple[str, ...] = ()
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()
    frame_id: str = ''
    order: str = '<'
    extra: int = 0
    padding: int = 0

    def cdr(self):
        out = bytearray(
            b'\x00\x01\x00\x00' if self.order == '<' else b'\x00\x00\x00\x00'
        )

        def align(size):
            while (len(out) - 4) % size:
                out.append(self.padding)

        def count(n):
            align(4)
            out.extend(struct.pack(self.order + 'I', n))

        def string(text):
            data = text.encode() + b'\x00'
            count(len(data))
            out.extend(data)

        out.extend(struct.pack(self.order + 'iI', self.sec, self.nanosec))
        string(self.frame_id)
        count(len(self.names))
        for name in self.names:
            string(name)
        for values in (self.positions, self.velocities, self.efforts):
            count(len(values))
            if values:
                align(8)
            out.extend(struct.pack(f'{self.order}{len(values)}d', *values))
        return bytes(out) + bytes([self.padding]) * self.extra


@dataclass
class Held:
    stamp: int
    position: float
    velocity: float


class JointModel:
    """The rules of the input, one after the other, with no thought of speed.

    `chains` maps the name of each chain to its joints' ranges, {joint: (lower, upper)}; `timeout`
    is in ns. What is counted, is counted from the last `count_anew` on.
    """

    def __init__(self, chains, timeout):
        self.chains = chains
        self.timeout = timeout
        self.held = {}
        self.count_anew()

    def count_anew(self):
        self.messages = 0
        self.rejected = Counter()
        self.joints_by_frame_id = {}
        self.ready = Counter()
        self.silent = Counter()
        self.held_back = {name: Counter() for name in self.chains}
        self.concerned = {name: set() for name in self.chains}  # (reason, joint)

    def update(self, stamp, message):
        """Return (chain, positions, velocities or None) for every chain that is ready."""
        self.messages += 1
        names = message.names
        if len(message.positions) == 0:
            return self.reject('empty_position')
        if len(message.positions) != len(names):
            return self.reject('position_length')
        for name in names:
            if names.count(name) > 1:
                return self.reject('duplicate_name')
        wanted = [joint for chain in self.chains.values() for joint in chain]
        brought = [name for name in names if name in wanted]
        if not brought:
            return []
        self.joints_by_frame_id.setdefault(message.frame_id, set()).update(brought)
        if self.has_stepped_back(stamp, brought):
            self.reject('time_jump')
            self.held = {}
        for name in brought:
            self.held[name] = self.seen(stamp, message, names.index(name))
        return self.ready_chains(brought)

    def ready_chains(self, brought):
        vectors = []
        for name, chain in self.chains.items():
            if chain.keys().isdisjoint(brought):
                continue
            if self.is_ready(name):
                positions = tuple(self.held[joint].position for joint in chain)
                vectors.append((name, positions, self.velocities(name)))
                self.ready[name] += 1
            else:
                self.silent[name] += 1
        return vectors

    def seen(self, stamp, message, place):
        velocity = math.nan
        if len(message.velocities) == len(message.names):
            velocity = message.velocities[place]
        return Held(stamp, message.positions[place], velocity)

    def reject(self, reason):
        self.rejected[reason] += 1
        return []

    def has_stepped_back(self, stamp, brought):
        for joint, held in self.held.items():
            if joint in brought and held.stamp > stamp:
                return True
            if self.timeout > 0 and held.stamp - stamp > self.timeout:
                return True
        return False

    def is_ready(self, name):
        chain = self.chains[name]
        newest = max(self.held[joint].stamp for joint in chain if joint in self.held)
        faults = set()
        for joint in chain:
            if joint not in self.held:
                faults.add(('missing_joint', joint))
            elif self.timeout > 0 and newest - self.held[joint].stamp > self.timeout:
                faults.add(('stale_joint', joint))
            elif not -LARGEST < self.held[joint].position < LARGEST:
                faults.add(('non_finite', joint))
        self.hold_back(name, faults)
        if faults:
            return False
        for joint, (lower, upper) in chain.items():
            if self.held[joint].position < lower or self.held[joint].position > upper:
                self.concerned[name].add(('out_of_range', joint))
        return True

    def velocities(self, name):
        velocities = tuple(self.held[joint].velocity for joint in self.chains[name])
        faults = set()
        for joint, velocity in zip(self.chains[name], velocities):
            if not -LARGEST < velocity < LARGEST:
                faults.add(('no_velocity', joint))
        self.hold_back(name, faults)
        return None if faults else velocities

    def hold_back(self, name, faults):
        self.concerned[name] |= faults
        for reason in {reason for reason, _ in faults}:
            self.held_back[name][reason] += 1
