"""A joint input of the iCub's legs, fed with messages of which a test says what matters to it."""

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.joint_input import JointInput
from support.joint_model import Message

MS = 1_000_000  # ns
START = 1_700_000_000_000 * MS
LEGS = Catalog.load().select(['left_leg=v2_5', 'right_leg=v2_5'])
LEFT, RIGHT = (chain.joint_names for chain in LEGS)
BOTH = LEFT + RIGHT


class LegInput(JointInput):
    """A joint input of both legs."""

    def __init__(self, timeout=0.5, velocities=True, joint_prefix=''):
        super().__init__(lambda: START)
        legs = Configuration.checked(Catalog.load(), joint_prefix=joint_prefix).chains
        self.configure(legs, timeout, velocities)

    def send(self, ms, names=BOTH, positions=None, velocities=(), **more):
        """Send a message at a time [ms from the start] and return what it makes ready."""
        sec, nanosec = divmod(START + ms * MS, 1_000_000_000)
        if positions is None:
            positions = [-0.01 * i for i in range(len(names))]
        message = Message(
            sec, nanosec, tuple(names), tuple(positions), tuple(velocities), **more
        )
        return self.feed(message.cdr())

    def ready(self, *args, **kwargs):
        """Send a message and return the names of the chains it makes ready."""
        return [vector.chain.name for vector in self.send(*args, **kwargs)]
