"""Starting with bad arguments, and stopping at any moment."""

from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
import os
from pathlib import Path
import shlex
import signal
import subprocess
import sys
import time

from icub_leg_fk.node import main as start
from icub_leg_fk.node.parameters import PARAMETERS
import pytest
from support.described_robots import own_description
from support.node_harness import BOTH, DEADLINE, LOSSLESS, NodeProcess, Robot, SECOND

INT, TERM = signal.SIGINT, signal.SIGTERM
QOS = 'qos_overrides./joint_states.subscription'
LOG_SETTINGS = (
    'RCUTILS_COLORIZED_OUTPUT',
    'RCUTILS_LOGGING_USE_STDOUT',
    'RCUTILS_LOGGING_BUFFERED_STREAM',
)
RUN = [sys.executable, '-m', 'icub_leg_fk.node.main']

# Arguments after --ros-args, and what the line says.
BAD = {
    '-p version:=v9': "parameter version: unknown version 'v9' of chain left_leg; known: v1, v2_5",
    '-p version:=2.5': 'parameter version: found 2.5, allowed: a version of the kinematics file',
    '-p chains:=[]': 'parameter chains: no chain is named; allowed: one or more of left_leg',
    '-p chains:=left_leg': "parameter chains: found 'left_leg', allowed: a list of chains",
    '-p chains:=[1,2]': 'parameter chains: found [1, 2], allowed: a list of chains',
    '-p chains:=[head_imu=v1]': "parameter chains: unknown version 'v1' of chain head_imu",
    '-p foot_frame:=toe': "parameter foot_frame: found 'toe', allowed: dh or sole",
    '-p joint_timeout:=-1.0': 'found -1.0, allowed: a number with a decimal point from 0.0',
    '-p joint_timeout:=.nan': 'parameter joint_timeout: found nan, allowed: a number',
    '-p joint_timeout:=soon': "parameter joint_timeout: found 'soon', allowed: a number",
    '-p publish_twist:=1': 'parameter publish_twist: found 1, allowed: true or false',
    '-p kinematics_file:=/no/such.yaml': 'cannot read /no/such.yaml',
    '-p kinematics_file:=/': 'cannot read /: ',
    '-p kinematics_file:=true': 'parameter kinematics_file: found True, allowed: path of a file',
    '-p description_from_topic:=true -p kinematics_file:=a.urdf': (
        "parameter description_from_topic: found true beside kinematics_file 'a.urdf'; allowed"
    ),
    '-p description_from_topic:=true -p version:=v1': (
        "parameter version: found 'v1', allowed with description_from_topic: none, or urdf"
    ),
    '-p description_from_topic:=true -p chains:=[]': 'parameter chains: no chain is named',
    '-p joint_prefix:=3': 'parameter joint_prefix: found 3, allowed: printable characters',
    '-p use_sim_time:=5': "'use_sim_time'",
    '-p versoin:=v1': "unknown parameter 'versoin'; did you mean 'version'?",
    '-p foot_pose_publisher:frame:=dh': "unknown parameter 'frame'",
    '-p left_leg.version:=v1': "unknown parameter 'left_leg.version'; known: chains, version",
    f'-p {QOS}.reliability:=sure': "found 'sure', allowed: system_default or reliable or",
    f'-p {QOS}.depth:=-4': 'found -4, allowed: an integer from 1',
    f'-p {QOS}.depth:=many': "found 'many', allowed: an integer",
    f'-p {QOS}.dept:=4': "unknown policy in qos_overrides 'dept'; did you mean 'depth'? known",
    '-p qos_overrides./joint_state.subscription.depth:=4': "did you mean '/joint_states'?",
    '-p qos_overrides./joint_states.publisher.depth:=4': "'publisher'; known: subscription",
    '-p version=v1': "unknown argument '-p version=v1'; did you mean -p version:=v1?",
    '-r version:=v1': "unknown argument '-r version:=v1'; did you mean -p version:=v1?",
    'version:=v1': 'did you mean --ros-args -p version:=v1?',
    '--params-file /no/such.yaml': '/no/such.yaml',
    '-r __ns:=a-b': '__ns:=a-b',
    '-r joint_states:=a-b': 'joint_states:=a-b',
    '--log-level loud': 'loud',
    '--bogus': "unknown argument '--bogus' after --ros-args",
    '-- bogus': "unknown argument 'bogus'; parameters go after --ros-args",
}
OTHERS_PARAMETERS = {
    'tool_frame': 'tool0',
    'robot_frame': 'base_link',
    'publish_marker': True,
    'robot_description': '<robot/>',
    'publish_rate': 50.0,
    'tf_prefix': 'icub1',
    'qos_overrides./tf.publisher.depth': 10,
    'qos_overrides./clock.subscription.depth': 5,
    'qos_overrides./joint_states.publisher.depth': 7,
    'qos_overrides./joint_states.subscription.liveliness': 'automatic',
    'qos_overrides./robot_description.publisher.durability': 'volatile',
}


@pytest.fixture
def refused(monkeypatch, capfd):
    """Return a function that starts the node and returns the line by which it is refused."""
    before = {number: signal.getsignal(number) for number in (INT, TERM)}

    def start_with(*arguments):
        monkeypatch.setattr(sys, 'argv', ['foot_pose_publisher', *arguments])
        assert start.main() == 1
        out, err = capfd.readouterr()
        lines = [line for line in err.splitlines() if '] [rcl]: ' not in line]
        assert (out, len(lines)) == ('', 1), out + err
        assert lines[0].startswith('foot_pose_publisher: error: ')
        return lines[0]

    yield start_with
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('arguments', BAD)
def test_bad_argument_is_refused_in_one_line(refused, arguments):
    assert BAD[arguments] in refused('--ros-args', *shlex.split(arguments))


@pytest.mark.parametrize('name', OTHERS_PARAMETERS)
def test_parameter_that_the_node_does_not_have_is_refused_on_the_command_line(
    refused, name
):
    line = refused('--ros-args', '-p', f'{name}:={OTHERS_PARAMETERS[name]}')
    assert 'unknown' in line


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed')
def test_transforms_without_tf2_msgs_are_refused(refused):
    assert 'tf2_msgs' in refused('--ros-args', '-p', 'publish_tf:=true')


def test_a_root_that_a_urdf_does_not_have_is_refused_on_the_command_line(
    refused, tmp_path
):
    file = tmp_path / 'robot.urdf'
    file.write_text(own_description('v2_5'))
    line = refused(
        '--ros-args', '-p', f'kinematics_file:={file}', '-p', 'root_frame:=base'
    )
    assert (
        f"parameter root_frame: unknown link 'base' of {file}; known: l_foot_dh_frame"
        in line
    )


WITHOUT_RCLPY = (
    'import sys; sys.modules["rclpy"] = None; '
    'from icub_leg_fk.node.main import main; sys.exit(main())'
)


@pytest.mark.parametrize(
    ('command', 'words'),
    [
        (
            [*RUN, '--ros-args', '-p', 'verson:=v1'],
            "unknown parameter 'verson'; did you mean 'version'? known: chains, v",
        ),
        (
            [sys.executable, '-c', WITHOUT_RCLPY],
            'the node needs rclpy, which is not installed: source ROS 2, or pip',
        ),
    ],
    ids=['unknown', 'no rclpy'],
)
def test_refusal_is_exit_code_one_and_a_line(command, words):
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE)
    assert (done.returncode, done.stdout, done.stderr.count('\n')) == (1, '', 1)
    assert words in done.stderr


def test_help_names_every_parameter():
    shown = subprocess.check_output(
        [*RUN, '--help'], stderr=subprocess.STDOUT, text=True, timeout=DEADLINE
    )
    assert shown.startswith('usage: ')
    words = shown.replace(',', ' ').replace('.', ' ').split()
    assert {parameter.name for parameter in PARAMETERS} <= set(words)


def test_files_for_all_nodes_and_for_others_are_no_reason_not_to_start(tmp_path):
    everybodys, others = tmp_path / 'all_nodes.yaml', tmp_path / 'others.yaml'
    lines = [f'    {name}: {value}\n' for name, value in OTHERS_PARAMETERS.items()]
    everybodys.write_text(
        '/**:\n  ros__parameters:\n    version: v1\n' + ''.join(lines)
    )
    others.write_text('/other/foot_pose_publisher: {ros__parameters: {version: v3}}\n')
    files = ['--params-file', str(everybodys), '--params-file', str(others)]
    with NodeProcess(arguments=files, namespace='') as node:
        node.wait_for_log('publishing poses of left_foot (left_leg=v1,')
        log = node.log()
    warnings = [
        line.partition(']: ')[2] for line in log.splitlines() if '[WARN]' in line
    ]
    assert warnings == [
        'ignored parameters that this node does not have: tool_frame (did you mean root_frame?), '
        'robot_frame (did you mean root_frame?), publish_marker (did you mean publish_markers?), '
        'robot_description, publish_rate (did you mean publish_tf?), '
        'tf_prefix (did you mean joint_prefix?), '
        + ', '.join(list(OTHERS_PARAMETERS)[6:]),
        f'nothing was taken from {others}: it is for /other/foot_pose_publisher, and this node is '
        f'{node.namespace}/foot_pose_publisher',
    ]


def test_closed_stderr_does_not_keep_it_from_working():
    with subprocess.Popen(
        ['bash', '-c', f'exec {shlex.join(RUN)} 2>&-'],
        env={**os.environ, 'RCUTILS_LOGGING_USE_STDOUT': '1'},
        stdout=subprocess.PIPE,
        text=True,
    ) as node:
        assert any('publishing' in line for line in node.stdout)
        node.terminate()
        assert node.wait(DEADLINE) == 0


def wait_until_it_listens(node):
    """Wait until the node has its signal handlers, its first act.

    Python itself needs some 50 ms before any line of the node can run; in that time a signal ends
    the interpreter in its own way. Only the node catches SIGTERM.
    """
    status = Path(f'/proc/{node.process.pid}/status')
    deadline = time.monotonic() + DEADLINE
    while time.monotonic() < deadline:
        caught = int(status.read_text().partition('SigCgt:')[2].split()[0], 16)
        if caught >> (TERM - 1) & 1:
            return
        time.sleep(0.0005)
    raise AssertionError('no signal handlers')


def stop_after(delay, signals):
    with NodeProcess() as node:
        wait_until_it_listens(node)
        time.sleep(delay)  # this moment is under test, whatever the node is doing then
        node.stop(*signals)


@pytest.mark.parametrize(
    'signals',
    [[INT, INT], [TERM]],
    ids=lambda signals: '+'.join(number.name for number in signals),
)
def test_signals_at_any_moment_end_it_well(signals):
    delays = [0.0, 0.1, 0.25, 0.5]
    with ThreadPoolExecutor(4) as pool:  # more than there are processors: under load
        list(pool.map(stop_after, delays, [signals] * len(delays)))


def test_another_signal_while_it_is_going_down_changes_nothing():
    with NodeProcess() as node:
        node.wait_for_log('publishing')
        node.process.send_signal(INT)
        time.sleep(0.05)  # again the moment under test; the node may be gone by then
        if node.process.poll() is None:
            node.process.send_signal(TERM)
        node.check_end()


def test_signals_in_the_midst_of_traffic_end_it_well_whatever_the_log_is_set_to():
    parameters = {'publish_twist': True, 'publish_markers': True, **LOSSLESS}
    settings = dict.fromkeys(LOG_SETTINGS, 'true')
    with NodeProcess(parameters, environment=settings) as node, Robot(node) as robot:
        stamp = robot.connect()
        for i in range(300):
            robot.send(stamp + i * SECOND, BOTH, velocity=[0.0] * 12)
        node.stop(INT, INT)
