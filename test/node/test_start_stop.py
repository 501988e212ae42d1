"""Starting with bad parameters, and stopping at any moment."""

from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path
import shlex
import signal
import subprocess
import sys
import time

import pytest
from support.node_harness import BOTH, DEADLINE, LOSSLESS, NodeProcess, Robot, SECOND

INT, TERM = signal.SIGINT, signal.SIGTERM
QOS = 'qos_overrides./joint_states.subscription.'

# Arguments behind --ros-args, and what the line must contain.
BAD = {
    '-p version:=v9': ['version', "'v9'", 'v1, v2_5'],
    '-p version:=V1': ["'V1'", 'v1, v2_5'],
    '-p version:=2.5': ['version', '2.5'],
    '-p left_leg.version:=v7': ['left_leg.version', "'v7'", 'v1', 'v2_5'],
    '-p head_imu.version:=v2_5': ['head_imu.version', "'v2_5'", 'v2'],
    '-p chains:=[]': ['chains', 'left_leg, right_leg, head_imu'],
    '-p chains:=left_leg': ['chains', "'left_leg'"],
    '-p chains:=[left_leg,left_leg]': ['chains', 'each once'],
    '-p chains:=[lef_leg]': ["'lef_leg'", 'left_leg, right_leg, head_imu'],
    '-p chains:=[1,2]': ['chains', '[1, 2]'],
    '-p chains:=[head_imu]': ['head_imu', "'v2_5'", 'v2'],
    '-p foot_frame:=toe': ['foot_frame', "'toe'", 'dh', 'sole'],
    '-p frame_prefix:="a b"': ['frame_prefix', "'a b'"],
    '-p joint_timeout:=-1.0': ['joint_timeout', '-1.0', '0.0'],
    '-p joint_timeout:=.nan': ['joint_timeout', 'nan'],
    '-p joint_timeout:=.inf': ['joint_timeout', 'inf'],
    '-p joint_timeout:=soon': ['joint_timeout', "'soon'"],
    '-p stamp_source:=later': ['stamp_source', "'later'", 'message', 'now'],
    '-p publish_twist:=1': ['publish_twist', 'true or false'],
    '-p publish_tf:=maybe': ['publish_tf', "'maybe'", 'true or false'],
    '-p kinematics_file:=/no/such.yaml': ['/no/such.yaml'],
    '-p kinematics_file:=/': ['/', 'directory'],
    '-p kinematics_file:=true': ['kinematics_file', 'True'],
    '-p verson:=v1': ["unknown parameter 'verson'; did you mean 'version'?"],
    '-p left_leg.verson:=v1': ["did you mean 'left_leg.version'?"],
    '-p versoin:=v1': ["did you mean 'version'?"],
    '-p publish_twsit:=true': ["did you mean 'publish_twist'?"],
    '-- version:=v1': ["'version:=v1'", 'did you mean --ros-args -p version:=v1?'],
    '-- _version:=v1': ["'_version:=v1'", 'did you mean --ros-args -p version:=v1?'],
    '-- joint_states:=/x': ['did you mean --ros-args -r joint_states:=/x?'],
    '-- __node:=x': ['did you mean --ros-args -r __node:=x?'],
    '-p use_sim_time:=5': ['use_sim_time', '5', 'BOOL'],
    f'-p {QOS}reliability:=sure': ['reliability', "'sure'", 'reliable or best_effort'],
    f'-p {QOS}depth:=-4': ['depth', '-4', '1'],
    f'-p {QOS}depth:=many': ['depth', "'many'"],
    f'-p {QOS}dept:=4': ['dept', 'depth'],
    '-p qos_overrides./joint_state.subscription.depth:=4': ['/joint_states.subscription'],
    '-p version': ['version'],
    '--params-file /no/such.yaml': ['/no/such.yaml'],
    '-r __ns:=a-b': ['__ns:=a-b'],
    '-r joint_states:=a-b': ['joint_states:=a-b'],
    '--bogus': ['--bogus'],
    '--log-level loud': ['loud'],
    '-- bogus': ["'bogus'"],
}


def run(arguments):
    return subprocess.run(
        [sys.executable, '-m', 'icub_leg_fk.node.main', '--ros-args',
         *shlex.split(arguments)],
        capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope='module')
def runs():
    """Return what the node did with each bad argument; run side by side, for time."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(BAD, pool.map(run, BAD), strict=True))


@pytest.mark.parametrize('arguments', BAD)
def test_bad_argument_ends_in_one_line_and_exit_code_one(runs, arguments):
    done = runs[arguments]
    assert (done.returncode, done.stdout) == (1, '')
    assert done.stderr.startswith('foot_pose_publisher: error: ')
    assert done.stderr.count('\n') == 1
    for word in BAD[arguments]:
        assert word in done.stderr


def test_assignment_before_ros_args_is_refused():
    done = subprocess.run(
        [sys.executable, '-m', 'icub_leg_fk.node.main', 'version:=v1', '--ros-args', '-p',
         'foot_frame:=sole'], capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout) == (1, '')
    assert done.stderr == ("foot_pose_publisher: error: unknown argument 'version:=v1'; "
                           'did you mean --ros-args -p version:=v1?\n')


def test_parameters_of_other_nodes_are_passed_over_and_named_once(tmp_path):
    file = tmp_path / 'all_nodes.yaml'
    file.write_text('/**:\n  ros__parameters:\n    robot_description: <robot/>\n'
                    '    publish_rate: 50.0\n    version: v1\n')
    with NodeProcess(arguments=['--params-file', str(file)]) as node:
        node.wait_for_log('(left_leg v1,')
        [warning] = [line for line in node.log().splitlines() if '[WARN]' in line]
        assert warning.endswith('of this node: robot_description, publish_rate')


def test_what_rcl_warns_of_is_shown():
    with NodeProcess(arguments=['--log-level', 'rcl:=debug']) as node:
        node.wait_for_log('publishing')
        assert '[rcl]' in node.log()


@pytest.mark.parametrize('setting', ['RCUTILS_COLORIZED_OUTPUT', 'RCUTILS_LOGGING_USE_STDOUT',
                                     'RCUTILS_LOGGING_BUFFERED_STREAM'])
def test_bad_settings_of_the_log_do_not_keep_it_from_working(setting):
    with NodeProcess(environment={setting: 'true'}) as node, Robot(node) as robot:
        robot.connect()


def test_domain_that_dds_does_not_have_is_refused_in_one_line():
    node = subprocess.run([sys.executable, '-m', 'icub_leg_fk.node.main'], check=False, text=True,
                          env={**os.environ, 'ROS_DOMAIN_ID': '233'}, capture_output=True,
                          timeout=DEADLINE)
    assert (node.returncode, node.stdout) == (1, '')
    assert node.stderr == (
        'foot_pose_publisher: error: ROS_DOMAIN_ID: found 233, allowed: 0 to 232\n')


def test_closed_stderr_does_not_keep_it_from_working():
    with subprocess.Popen(['bash', '-c', f'exec {sys.executable} -m icub_leg_fk.node.main 2>&-'],
                          env={**os.environ, 'RCUTILS_LOGGING_USE_STDOUT': '1'},
                          stdout=subprocess.PIPE, text=True) as node:
        assert any('publishing' in line for line in node.stdout)
        node.terminate()
        assert node.wait(DEADLINE) == 0


def test_loopback_that_is_down_is_told_with_what_mends_it():
    without_loopback = ['unshare', '--map-root-user', '--net']
    if subprocess.run([*without_loopback, 'true'], capture_output=True, check=False).returncode:
        pytest.skip('no network namespace can be made here')
    with subprocess.Popen([*without_loopback, sys.executable, '-m', 'icub_leg_fk.node.main'],
                          stderr=subprocess.PIPE, text=True) as node:
        said = next(line for line in node.stderr
                    if 'loopback' in line or 'no JointState' in line)  # the next to be said
        node.terminate()
        assert node.wait(DEADLINE) == 0
    assert said.endswith('this brings it up: sudo ip link set lo up\n')


def test_transforms_without_tf2_msgs_are_refused_in_one_line():
    try:
        import tf2_msgs
    except ImportError:
        done = run('-p publish_tf:=true')
        assert (done.returncode, done.stdout, done.stderr.count('\n')) == (1, '', 1)
        assert 'tf2_msgs' in done.stderr
    else:
        pytest.skip(f'tf2_msgs is there: {tf2_msgs.__file__}')


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
        time.sleep(delay)  # what is tested here: this moment, whatever the node is doing then
        node.stop(*signals)


@pytest.mark.parametrize('signals', [[INT], [TERM], [INT, INT], [TERM, TERM], [INT, TERM]],
                         ids=lambda signals: '+'.join(number.name for number in signals))
def test_signals_at_any_moment_end_it_well(signals):
    delays = [0.0, 0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8]
    with ThreadPoolExecutor(4) as pool:  # more than there are processors: under load
        list(pool.map(stop_after, delays, [signals] * len(delays)))


@pytest.mark.parametrize('pause', [0.0, 0.001, 0.01, 0.03, 0.1, 0.3])
def test_second_signal_while_it_is_going_down_changes_nothing(pause):
    with NodeProcess() as node:
        node.wait_for_log('publishing')
        node.process.send_signal(INT)
        time.sleep(pause)  # again the moment under test; the node may be gone by then
        if node.process.poll() is None:
            node.process.send_signal(INT)
        node.check_end(0)


@pytest.mark.parametrize('signals', [[INT, INT], [TERM]])
def test_signals_in_the_midst_of_traffic_end_it_well(signals):
    with NodeProcess({'publish_twist': True, 'publish_markers': True, **LOSSLESS}) as node, \
            Robot(node) as robot:
        stamp = robot.connect()
        for i in range(300):
            robot.send(stamp + i * SECOND, BOTH, velocity=[0.0] * 12)
        node.stop(*signals)
