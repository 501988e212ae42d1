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
        out = bytearray(b'\x00\x01\x00\x00' if self.order == '<' else b'\x00\x00\x00\x00')

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

    `chains` is a list of {joint: (lower, upper)}; `timeout` is in ns.
    """

    def __init__(self, chains, timeout):
        self.chains = chains
        self.timeout = timeout
        self.held = {}
        self.messages = 0
        self.counts = Counter()
        self.ready = [0] * len(chains)
        self.held_back = [Counter() for _ in chains]
        self.concerned = [set() for _ in chains]  # (reason, joint)

    def update(self, stamp, names, positions, velocities):
        """Return (chain, positions, velocities or None) for every chain that is ready."""
        self.messages += 1
        if len(positions) == 0:
            self.counts['empty_position'] += 1
            return []
        if len(positions) < len(names):
            self.counts['short_position'] += 1
            return []
        for name in names:
            if names.count(name) > 1:
                self.counts['duplicate_name'] += 1
                return []
        brought = [name for name in names if any(name in chain for chain in self.chains)]
        if not brought:
            return []
        if self.has_stepped_back(stamp, brought):
            self.counts['time_jump'] += 1
            self.held = {}
        for i in range(len(names)):
            if names[i] in brought:
                velocity = velocities[i] if len(velocities) >= len(names) else math.nan
                self.held[names[i]] = Held(stamp, positions[i], velocity)
        ready = []
        for index, chain in enumerate(self.chains):
            if any(joint in brought for joint in chain) and self.is_ready(index):
                self.ready[index] += 1
                for joint, (lower, upper) in chain.items():
                    if self.held[joint].position < lower or self.held[joint].position > upper:
                        self.concerned[index].add(('out_of_range', joint))
                speeds = tuple(self.held[joint].velocity for joint in chain)
                ready.append((index, tuple(self.held[joint].position for joint in chain),
                              speeds if all(-LARGEST < v < LARGEST for v in speeds) else None))
        return ready

    def has_stepped_back(self, stamp, brought):
        for joint in brought:
            if joint in self.held and self.held[joint].stamp > stamp:
                return True
        return self.timeout > 0 and any(
            held.stamp - stamp > self.timeout for held in self.held.values())

    def is_ready(self, index):
        chain = self.chains[index]
        newest = max(self.held[joint].stamp for joint in chain if joint in self.held)
        faults = set()
        for joint in chain:
            if joint not in self.held:
                faults.add(('missing_joint', joint))
            elif self.timeout > 0 and newest - self.held[joint].stamp > self.timeout:
                faults.add(('stale_joint', joint))
            elif not -LARGEST < self.held[joint].position < LARGEST:
                faults.add(('non_finite', joint))
        self.concerned[index] |= faults
        for reason in {reason for reason, _ in faults}:
            self.held_back[index][reason] += 1
        return not faults

    @property
    def newest(self):
        return max((held.stamp for held in self.held.values()), default=None)

    def counts_taken(self):
        """Start counting anew what is counted per chain."""
        self.ready = [0] * len(self.chains)
        self.held_back = [Counter() for _ in self.chains]
        self.concerned = [set() for _ in self.chains]
