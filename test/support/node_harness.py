"""Help for tests of the node: it runs in a process of its own and is spoken to over DDS only.

`NodeProcess` is the node, `Robot` another participant that publishes joint states and listens.
Nothing sleeps for a fixed time: everything waits for an event, up to a deadline. That nothing
arrives is shown by a later message whose answer must be the next to arrive.
"""

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

SECOND = 1_000_000_000  # ns
DEADLINE = 60.0  # s; far beyond what anything here takes, for busy machines
LEG_JOINTS = ('hip_pitch', 'hip_roll', 'hip_yaw', 'knee', 'ankle_pitch', 'ankle_roll')
LEFT = tuple(f'l_{joint}' for joint in LEG_JOINTS)
RIGHT = tuple(f'r_{joint}' for joint in LEG_JOINTS)
BOTH = LEFT + RIGHT
HEAD = ('torso_pitch', 'torso_roll', 'torso_yaw', 'neck_pitch', 'neck_roll', 'neck_yaw')
FEET = ('left_foot', 'right_foot')
OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK,
    DiagnosticStatus.WARN,
    DiagnosticStatus.ERROR,
    DiagnosticStatus.STALE,
)
DEEP = QoSProfile(depth=5000)  # reliable

_numbers = itertools.count(1)
_WITHOUT_EVENTS_EXECUTOR = (
    "import sys; sys.modules['rclpy.experimental.events_executor'] = None; "
    'from icub_leg_fk.node.main import main; sys.exit(main())'
)


LOSSLESS = {
    'qos_overrides.{ns}/joint_states.subscription.reliability': 'reliable',
    'qos_overrides.{ns}/joint_states.subscription.depth': 5000,
    **{
        f'qos_overrides.{{ns}}/foot_pose_publisher/{tip}/pose.publisher.depth': 5000
        for tip in FEET
    },
}
"""Parameters by which no message is lost, however fast they come."""


class NodeProcess:
    """The node, running; leaving the `with` stops it and checks how it went.

    Args:
        parameters: parameter values by name, in which {ns} stands for the namespace.
        arguments: what else stands behind `--ros-args`.
        namespace: its namespace, '' for none; one that nobody else has, unless told.
        events_executor: False takes rclpy's EventsExecutor away from it.
        environment: variables to add.
    """

    def __init__(
        self,
        parameters=None,
        arguments=(),
        namespace=None,
        events_executor=True,
        environment=None,
    ):
        self.namespace = f'/robot_{next(_numbers)}' if namespace is None else namespace
        program = ['-m', 'icub_leg_fk.node.main']
        if not events_executor:
            program = ['-c', _WITHOUT_EVENTS_EXECUTOR]
        command = [sys.executable, *program, '--ros-args', *arguments]
        command += ['-r', f'__ns:={self.namespace or "/"}']
        for name, value in (parameters or {}).items():
            command += ['-p', f'{name.format(ns=self.namespace)}:={json.dumps(value)}']
        self._log = tempfile.TemporaryFile()
        self.process = subprocess.Popen(
            command,
            stdout=self._log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, **(environment or {})},
        )

    def __enter__(self):
        return self

    def __exit__(self, kind, error, traceback):
        if kind is None:
            self.stop()
        else:
            self.process.kill()
            self.process.wait()
            print(self.log())

    def topic(self, name):
        """Return the full name of one of the node's own topics."""
        return f'{self.namespace}/foot_pose_publisher/{name}'

    def log(self):
        """Return what the node has written so far."""
        file = self._log.fileno()  # of which the node has a place of its own
        return os.pread(file, os.fstat(file).st_size, 0).decode()

    def stop(self, *signals):
        """Stop it (SIGINT, unless told otherwise) and check that it ends well."""
        for number in signals or (signal.SIGINT,):
            self.process.send_signal(number)
        self.check_end()

    def check_end(self):
        """Wait until it has ended well: exit code 0 and no traceback."""
        try:
            found = self.process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise AssertionError(f'still running; it says:\n{self.log()}') from None
        log = self.log()
        assert found == 0, f'exit code {found}; it says:\n{log}'
        assert not re.search(
            'Traceback|Exception|terminate called|Fatal|Segmentation', log
        )

    def wait_for_log(self, text):
        """Wait until the node has said something."""
        deadline = time.monotonic() + DEADLINE
        while text not in self.log():
            assert self.process.poll() is None, f'it ended:\n{self.log()}'
            assert time.monotonic() < deadline, f'no {text!r} in:\n{self.log()}'
            time.sleep(0.005)


def lines(node, severity):
    """Return what a node has said, from the text on."""
    marked = [line for line in node.log().splitlines() if f'[{severity}]' in line]
    return [line.partition('foot_pose_publisher]: ')[2] for line in marked]


class Inbox(list):
    """Messages received, oldest first."""

    def stamps(self):
        """Return their stamps [ns]."""
        return [nanoseconds(message.header.stamp) for message in self]


def nanoseconds(stamp):
    """Return a stamp as an integer [ns]."""
    return stamp.sec * SECOND + stamp.nanosec


class Status(NamedTuple):
    """What diagnostics say of a chain."""

    level: bytes
    message: str
    hardware_id: str
    values: dict[str, str]


def statuses_in(array, node):
    """Return what diagnostics say of a node's chains, by chain."""
    statuses = {}
    for status in array.status:
        name, _, chain = status.name.partition(': ')
        if name == node:
            values = {item.key: item.value for item in status.values}
            statuses[chain] = Status(
                status.level, status.message, status.hardware_id, values
            )
    return statuses


class Robot:
    """A participant that publishes joint states and collects what the node publishes.

    Args:
        node: the node under test, whose namespace it shares.
        tips: whose poses to listen to.
        name: name under which the node under test runs.
    """

    def __init__(self, node, tips=FEET, name='foot_pose_publisher'):
        self._context = Context()
        rclpy.init(context=self._context)
        self.node = Node(
            'robot',
            namespace=node.namespace,
            context=self._context,
            enable_rosout=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._name = name
        self._name_in_status = f'{node.namespace}/{name}'.lstrip('/')
        self.joints = self.node.create_publisher(JointState, 'joint_states', DEEP)
        self.poses = {
            tip: self.listen(PoseStamped, f'{name}/{tip}/pose') for tip in tips
        }
        self.left, self.right = (self.poses.get(tip) for tip in FEET)
        self.diagnostics = self.listen(DiagnosticArray, '/diagnostics')
        self._parameters = None

    def __enter__(self):
        return self

    def __exit__(self, kind, error, traceback):
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def listen(self, message_type, topic, qos=DEEP):
        """Return a list that fills with the messages of a topic."""
        inbox = Inbox()
        self.node.create_subscription(message_type, topic, inbox.append, qos)
        return inbox

    def spin(self, seconds=0.0):
        """Take in what has arrived, or what arrives next."""
        self._executor.spin_once(timeout_sec=seconds)

    def until(self, condition, what):
        """Spin until a condition holds."""
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, f'not within {DEADLINE} s: {what}'
            self.spin(0.02)

    def send(self, stamp, names=BOTH, positions=None, publisher=None, **fields):
        """Publish a JointState with a stamp [ns]; positions default to -0.01, -0.02, ..."""
        if positions is None:
            positions = [-0.01 * (i + 1) for i in range(len(names))]
        message = JointState(
            name=list(names), position=[float(p) for p in positions], **fields
        )
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        (publisher or self.joints).publish(message)

    def connect(self, start=SECOND, names=BOTH, inboxes=None, publisher=None):
        """Send joint states until they are answered on every topic; return the last stamp."""
        inboxes = list(self.poses.values()) if inboxes is None else inboxes
        stamp = start
        deadline = time.monotonic() + DEADLINE

        def is_answered():
            return all(stamp in inbox.stamps()[-1:] for inbox in inboxes)

        while not is_answered():
            assert time.monotonic() < deadline, 'the node does not answer'
            stamp += 1000
            self.send(stamp, names, publisher=publisher)
            again = time.monotonic() + 0.1
            while time.monotonic() < again and not is_answered():
                self.spin(0.02)
        for inbox in self.poses.values():
            inbox.clear()
        return stamp

    def wait_for(self, inbox, stamp):
        """Wait until the newest message of an inbox has this stamp."""
        self.until(
            lambda: inbox.stamps()[-1:] == [stamp],
            f'stamp {stamp} after {inbox.stamps()[-3:]}',
        )

    def take(self, inbox, last):
        """Return what an inbox holds up to a stamp, once that is there, and empty it."""
        self.wait_for(inbox, last)
        taken = Inbox(inbox)
        inbox.clear()
        return taken

    def parameters(self):
        """Return a client of the node's parameter services, connected."""
        if self._parameters is None:
            self._parameters = AsyncParameterClient(self.node, self._name)
        self.until(self._parameters.services_are_ready, 'parameter services')
        return self._parameters

    def result(self, future):
        """Return what a service answers."""
        self.until(future.done, 'answer of a service')
        return future.result()

    def change(self, **values):
        """Set parameters atomically and return the result."""
        changes = [Parameter(name, value=value) for name, value in values.items()]
        return self.result(self.parameters().set_parameters_atomically(changes)).result

    def statuses(self, condition, meanwhile=lambda: None):
        """Wait for diagnostics of the node that meet a condition; return its statuses by chain.

        Args:
            condition: function of the statuses by chain.
            meanwhile: called every 10 ms while waiting, such as to send joint states.
        """
        self.diagnostics.clear()
        seen = []
        due = [0.0]

        def have_come():
            if time.monotonic() > due[0]:
                due[0] = time.monotonic() + 0.01
                meanwhile()
            for array in self.diagnostics:
                statuses = statuses_in(array, self._name_in_status)
                if statuses:
                    seen.append(statuses)
                if statuses and condition(statuses):
                    return True
            self.diagnostics.clear()
            return False

        self.until(have_come, seen)
        return seen[-1]
