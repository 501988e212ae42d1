"""`leg_fk view`: its page in a real browser; what is drawn and said without one."""

import math
from pathlib import Path
import re
import signal
import socket
import subprocess
import sys
from threading import Event, Thread
import time
from unittest.mock import MagicMock
import webbrowser

import hypothesis
from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.kinematics import Catalog, DHLink, load_chain
from icub_leg_fk.kinematics.rotation import turns_about
from icub_leg_fk.tools.ros import running_ros
from icub_leg_fk.tools.tracks import read_tracks, track_of
from icub_leg_fk.tools.viewer import PERIOD, Viewer
from icub_leg_fk.tools.viewer_live import following, LiveRobot
from icub_leg_fk.tools.viewer_method import arc, LAST_STEP, Method
from icub_leg_fk.tools.viewer_page import (
    running_server,
    slider_bounds,
    slider_start,
)
from icub_leg_fk.tools.viewer_recording import Recording
from icub_leg_fk.tools.viewer_scene import directions, labels, PosedChain
from icub_leg_fk.tools.viewer_source import posture_at
import numpy as np
import pytest
from support.any_chain import chain_of, chains_and_positions
from support.bag_files import joint_state, string
from support.browser import (
    copied_texts,
    running_tab,
    show_page,
    slider,
    still_picture,
    wait_until,
)
from support.described_robots import own_description
from support.leg_fk_process import assert_one_line_complaint, COMMAND, run_main

EXAMPLES = Path(__file__).resolve().parents[2] / 'config' / 'examples'
WALK = EXAMPLES / 'synthetic_walk.csv'
PANDA = EXAMPLES / 'panda.yaml'
LEGS = [load_chain(name) for name in ('left_leg', 'right_leg')]
LEG_JOINTS = [name for leg in LEGS for name in leg.joint_names]
_LISTENS = '0A'  # state of a socket in /proc/net/tcp
BENT = np.radians([0, 10, 0, -30, -15, 5]).tolist()


@pytest.fixture(scope='module')
def tab():
    """Return the one tab of the browser: drawing in two at once takes long without a GPU."""
    with running_tab() as tab:
        yield tab


@pytest.fixture(scope='module')
def view():
    """Run the command until Ctrl-C; return the process and the page's address."""
    pytest.importorskip('viser')
    process = subprocess.Popen(
        [*COMMAND, 'view', '--no-browser', '--port', '0'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        process.stdout.readline()
        yield process, process.stdout.readline().split()[0]
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
        assert (process.returncode, out, err) == (130, '', '')
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def page(tab, view):
    _, address = view
    return show_page(tab, address)


@pytest.fixture(scope='module')
def server():
    pytest.importorskip('viser')
    with running_server('127.0.0.1', 0) as server:
        yield server


@pytest.fixture
def page_of(tab, server):
    """Return what shows chains as a source moves them, in a page that is kept up to date."""
    ended = Event()
    threads = []

    def show(source):
        viewer = Viewer(server, source.chains, source)

        def run():
            while not ended.wait(PERIOD):
                viewer.refresh()

        threads.append(Thread(target=run))
        threads[0].start()
        return show_page(tab, f'http://127.0.0.1:{server.get_port()}/')

    yield show
    ended.set()
    threads[0].join()


def numbers(texts):
    """Return the numbers with seven decimals in texts, without the spaces that align them."""
    return sorted(re.findall(r'-?\d+\.\d{7}\b', ' '.join(texts)))


def wait_for_poses(page, poses):
    """Wait until a page shows the numbers that `leg_fk pose` prints of chains at positions."""
    printed = [run_main('pose', chain, '--radians', *q).stdout for chain, q in poses]
    wait_until(page, lambda: numbers(copied_texts(page)) == numbers(printed))


def test_each_joint_of_both_legs_has_a_slider(page):
    for name in LEG_JOINTS:
        assert slider(page, name).is_visible(), name


def test_a_moved_slider_gives_the_numbers_of_pose_and_a_red_line(page):
    knee = slider(page, 'l_knee')
    knee.press('Home')
    page.get_by_text('-150 deg is outside -124 .. 4 deg').wait_for()
    q = [0.0, 0.0, 0.0, math.radians(-150), 0.0, 0.0]
    wait_for_poses(page, [('left_leg', q), ('right_leg', [0.0] * 6)])
    page.get_by_role('button', name='back to the start').click()
    wait_until(page, lambda: knee.get_attribute('aria-valuenow') == '0')


def test_every_step_of_the_method_changes_the_scene(page):
    page.get_by_role('tab', name='Method').click()
    before = still_picture(page)
    for number in range(1, LAST_STEP + 1):
        slider(page, 'step').press('ArrowRight')
        page.get_by_text(f'Step {number}. ').wait_for()
        before = still_picture(page, other_than=before)
    page.get_by_text('T_RoLf = T_Ro0 T_06').wait_for()
    slider(page, 'step').press('ArrowLeft')
    slider(page, 'row').press('End')
    page.get_by_text('A_5 = T_56').wait_for()
    still_picture(page, other_than=before)


def test_nothing_listens_but_this_machine(view):
    process, address = view
    ((host, port),) = listening_addresses(process.pid)
    assert address == f'http://{host}:{port}/' == f'http://127.0.0.1:{port}/'


def listening_addresses(pid):
    """Return the TCP addresses at which a process listens, as Linux lists them."""
    if not Path('/proc/net/tcp').exists():
        pytest.skip('needs /proc of Linux')
    sockets = set()
    for descriptor in Path(f'/proc/{pid}/fd').iterdir():
        sockets.add(str(descriptor.readlink()))
    found = set()
    for file in ('tcp', 'tcp6'):
        for line in Path(f'/proc/{pid}/net/{file}').read_text().splitlines()[1:]:
            words = line.split()
            local, state, inode = words[1], words[3], words[9]
            if state == _LISTENS and f'socket:[{inode}]' in sockets:
                found.add(shown_address(*local.split(':')))
    return found


def shown_address(host, port):
    """Return an address that the kernel prints as words of 32 bits in the machine's order."""
    words = [bytes.fromhex(host[i : i + 8])[::-1] for i in range(0, len(host), 8)]
    family = socket.AF_INET if len(words) == 1 else socket.AF_INET6
    return socket.inet_ntop(family, b''.join(words)), int(port, 16)


def test_a_recording_is_played_and_paused(page_of):
    page = page_of(Recording(read_tracks([WALK], LEGS).tracks))
    time_line = slider(page, 'time [s]')
    assert not slider(page, 'l_knee').is_visible()  # it follows
    before = copied_texts(page)
    page.get_by_role('button', name='play').click()
    wait_until(page, lambda: copied_texts(page) != before)
    page.get_by_role('button', name='pause').click()
    page.get_by_role('button', name='play').wait_for()
    assert 0.0 < float(time_line.get_attribute('aria-valuenow')) < 4.99
    time_line.press('End')
    last = np.genfromtxt(WALK, delimiter=',', names=True)[-1]
    q = [float(last[name]) for name in LEG_JOINTS]
    wait_for_poses(page, [('left_leg', q[:6]), ('right_leg', q[6:])])


def test_a_live_robot_is_shown_by_its_description(page_of):
    robot = LiveRobot(LEGS[:1], ['/lab/joint_states'], select_left_leg)
    page = page_of(robot)
    page.get_by_text('the tables, until a description').wait_for()
    page.get_by_text('no pose yet').wait_for()
    robot.take_description(string(own_description('v1')))
    page.get_by_text('the description of robot_v1').wait_for()
    page.get_by_text('on /lab/robot_description').wait_for()
    page.get_by_text('left_leg=urdf', exact=True).first.wait_for()
    robot.take(joint_state(1, LEGS[0].joint_names, BENT))
    page.get_by_text('no pose for').wait_for()
    robot.take_description(string('<robot'))
    page.get_by_text('description of the robot not used').wait_for()
    page.get_by_text('the description of robot_v1').wait_for()
    page.get_by_text('no message on /lab/joint_states').wait_for()
    wait_for_poses(page, [('left_leg=v1', BENT)])


def select_left_leg(urdf):
    return Catalog.from_urdf(urdf).select(['left_leg'])


def test_the_page_is_opened_and_its_address_printed(monkeypatch):
    pytest.importorskip('viser')
    opened = []
    monkeypatch.setenv('DISPLAY', ':0')
    monkeypatch.setattr(webbrowser, 'open', opened.append)
    monkeypatch.setattr(Viewer, 'run', lambda viewer: viewer.refresh())
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = run_main('view', '--port', port)
    about, address = done.stdout.splitlines()
    assert done.returncode == 0
    assert (
        about
        == 'left_leg=v2_5, right_leg=v2_5 in root_link (x backward, y right, z up)'
    )
    assert address.split()[0] == opened[0] != f'http://127.0.0.1:{port}/'
    assert f'note: port {port} is taken' in done.stderr


def test_the_page_is_updated_at_most_30_times_a_second(server, monkeypatch):
    times = []

    def refresh(viewer):
        times.append(time.monotonic())
        if len(times) == 7:
            raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, 'refresh', refresh)
    with pytest.raises(KeyboardInterrupt):
        Viewer(server, LEGS, LiveRobot(LEGS)).run()
    assert times[-1] - times[0] > 6 / 30 - 1e-3


@pytest.mark.parametrize(
    ('words', 'complaint'),
    [
        (['--host', '192.0.2.1'], "--host: found '192.0.2.1'"),
        (['--port', '99999'], "found '99999', allowed: 1 to"),
        (['--joint-topic', '/x'], '--joint-topic goes with --recording or --live'),
        (['--description-from-topic'], 'topic goes with --recording or --live'),
        (['--live', '--description-from-topic', '-k', PANDA], 'without a kinematics'),
        (['--recording', 'none.csv'], 'none.csv: there is no such file'),
        (['--recording', WALK, WALK], 'brings joint l_hip_pitch, and so does'),
        (['--recording', 'a.csv', '--live'], 'not allowed with'),
        (['left_leg=v3', 'right_leg=v1'], 'do not go together'),
        (['left_legs'], "did you mean 'left_leg'?"),
    ],
)
def test_mistakes_are_one_line(words, complaint):
    pytest.importorskip('viser')
    assert_one_line_complaint(run_main('view', *words), complaint)


@pytest.mark.parametrize(
    ('library', 'words', 'install'),
    [('viser', [], 'pip install viser'), ('rclpy', ['--live'], 'source ROS 2')],
)
def test_a_missing_library_is_named_with_its_mend(monkeypatch, library, words, install):
    monkeypatch.setitem(sys.modules, library, None)
    done = run_main('view', *words)
    assert_one_line_complaint(
        done, f'needs {library}, which is not installed: {install}'
    )


def test_a_topic_with_no_such_name_is_refused():
    pytest.importorskip('rclpy')
    done = run_main('view', '--live', '--joint-topic', '/joint states')
    assert_one_line_complaint(done, "found '/joint states'; topic name must not")


def test_a_live_robot_moves_the_chains():
    pytest.importorskip('rclpy')
    robot = LiveRobot(LEGS[:1], ['view_test/joint_states'], select_left_leg)
    robot.add_controls(MagicMock(), None)
    deadline = time.monotonic() + 10.0
    with running_ros('the test', 'robot', 'view_test') as ros, following(robot):
        publisher = ros.node.create_publisher(ros.joint_state, 'joint_states', 10)
        qos = ros.rclpy.qos
        latched = qos.QoSProfile(
            depth=1, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL
        )
        descriptions = ros.node.create_publisher(
            ros.string, 'robot_description', latched
        )
        descriptions.publish(ros.string(data=own_description('v1')))
        message = ros.joint_state(
            name=['other', *LEGS[0].joint_names], position=[9.0, *BENT]
        )
        [posture] = robot.step()
        assert posture.q is None
        while posture.q is None or robot.chains[0].version != 'urdf':
            assert time.monotonic() < deadline
            publisher.publish(message)
            time.sleep(0.02)
            [posture] = robot.step()
    assert (posture.q, posture.note) == (BENT, '')
    np.testing.assert_allclose(posture.trail[-1], robot.chains[0].pose(BENT)[:3])


# What is drawn, and said, without a page.

FILES = {'panda': PANDA, 'arm': EXAMPLES / 'cylindrical_arm.yaml'}

each_kind = pytest.mark.parametrize('name', ['left_leg', 'right_leg', 'panda', 'arm'])


def example(name):
    """Return a chain: standard, modified, or with slides."""
    return load_chain(name, file=FILES.get(name))


@settings(max_examples=25)
@given(chains_and_positions())
@hypothesis.example((example('panda'), [[0.3, -0.5, 0.2, -1.5, 0.4, 1.2, 0.6]]))
def test_a_row_leads_from_frame_to_frame_along_z_and_the_common_normal(
    chain_and_positions,
):
    chain, (q, *_) = chain_and_positions
    posed = PosedChain(chain, q)
    method = Method(posed, 1.0)
    for row in range(len(chain.rows())):
        geometry = method.geometry(row)
        before, after = posed.frames[row], posed.frames[row + 1]
        along_z = (geometry.d_ends, geometry.d * geometry.z)
        along_x = (geometry.a_ends, geometry.a * geometry.x)
        ways, z, x = [along_z, along_x], before[:3, 2], after[:3, 0]
        if chain.convention == 'modified':  # which has the normal first
            ways, z, x = [along_x, along_z], after[:3, 2], before[:3, 0]
        np.testing.assert_array_equal([geometry.z, geometry.x], [z, x])
        place = before[:3, 3]
        for ends, way in ways:
            np.testing.assert_allclose(ends, [place, place + way], atol=1e-12)
            place = ends[1]
        np.testing.assert_allclose(place, after[:3, 3], atol=1e-12)
        for axis in (before[:3, 2], after[:3, 2]):
            assert abs(geometry.x @ axis) < 1e-12  # the normal is common to both
        x = turns_about(geometry.z, geometry.theta) @ before[:3, 0]
        z = turns_about(geometry.x, geometry.alpha) @ before[:3, 2]
        np.testing.assert_allclose([x, z], [after[:3, 0], after[:3, 2]], atol=1e-12)


@each_kind
def test_each_step_draws_what_it_is_about(name):
    chain = example(name)
    method = Method(PosedChain(chain, [0.3] * chain.n), 1.0)
    scenes = [set(method.scene(step, 0)) for step in range(1, 7)]
    for letter, step in (('z', 1), ('x', 3), ('y', 4)):
        assert [f'method/{letter} axes' in scene for scene in scenes[:4]] == [
            number >= step for number in range(1, 5)
        ]
    has_origins = ['method/origins' in scene for scene in scenes]
    assert has_origins == [False, True, True, True, False, False]
    assert {'method/two frames', 'method/theta_0'} <= scenes[4]
    assert 'method/tip' in scenes[5]


@each_kind
def test_the_steps_have_the_words_of_explain(name):
    chain = example(name)
    q = [0.3] * chain.n
    file = ['-k', FILES[name]] if name in FILES else []
    explained = run_main('explain', name, *file, '--radians', *q).stdout
    method = Method(PosedChain(chain, q), 1.0)
    last_row = len(chain.rows()) - 1
    for step, row in ((1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (5, last_row), (6, 0)):
        heading, _, words = method.words(step, row).partition('\n')
        assert heading.startswith(f'Step {step}. ') and heading in explained
        assert words.strip() in explained
        assert (f'A_{row} = ' in words) == (step >= 5)


@given(st.floats(-20, 20), st.floats(-3, 3))
def test_an_arc_ends_where_the_angle_leads(angle, direction):
    axis = np.array([0.0, math.sin(direction), math.cos(direction)])
    points = arc(np.ones(3), axis, np.array([0.1, 0.0, 0.0]), angle)
    turned = max(-2 * math.pi, min(2 * math.pi, angle))
    np.testing.assert_allclose(points[0], [1.1, 1.0, 1.0])
    np.testing.assert_allclose(
        points[-1], 1.0 + turns_about(axis, turned) @ [0.1, 0.0, 0.0], atol=1e-12
    )


def test_names_at_one_place_share_a_label():
    places = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]])
    assert [label.text for label in labels('x', 'abc', places, 1.0).values()] == [
        'a, c',
        'b',
    ]


def test_forward_is_against_x_where_x_points_backward():
    forward, left, up = directions(('backward', 'right', 'up'))
    np.testing.assert_array_equal([forward, left, up], np.diag([-1, -1, 1]))


LOWER = st.one_of(st.just(-math.inf), st.floats(-6, 6))
UPPER = st.one_of(st.just(math.inf), st.floats(-6, 6))


@given(LOWER, UPPER, st.sampled_from(['revolute', 'prismatic']))
def test_a_slider_goes_a_fifth_beyond_its_range(lower, upper, joint_type):
    lower, upper = min(lower, upper), max(lower, upper)
    link = DHLink(0.0, 0.0, 0.0, joint_type=joint_type, lower=lower, upper=upper)
    low, high = slider_bounds(link)
    unit, rounding = (1.0, 0.01) if link.is_prismatic else (180 / math.pi, 1.0)
    if math.isfinite(upper - lower):
        margin = 0.2 * (upper - lower)
        assert low == pytest.approx((lower - margin) * unit, abs=rounding)
        assert high == pytest.approx((upper + margin) * unit, abs=rounding)
    assert low <= slider_start(link) <= high


def test_the_newest_sample_is_shown_and_how_old_it_is():
    chain = chain_of([DHLink(0.0, 0.0, 0.0, joint_type='prismatic')])
    times, positions = np.array([1.0, 2.0, 3.0]), np.array([[0.1], [0.2], [0.3]])
    assert posture_at(0.5, chain, times, positions)[:2] == (None, 'no pose yet')
    assert posture_at(2.4, chain, times, positions)[:2] == ([0.2], '')
    q, note, trail = posture_at(4.0, chain, times, positions)
    assert (q, note) == ([0.3], 'no pose for 1.0 s')
    np.testing.assert_allclose(trail[:, 2], [0.2, 0.3])


def test_a_recording_is_shown_in_the_order_of_time_by_the_description_that_counted():
    times, positions = np.array([1.0, 3.0, 2.0]), np.zeros((3, 6))
    positions[:, 3] = [0.1, 0.3, 0.2]  # the clock was set
    tracks = [track_of(LEGS[0], times, positions)]
    tracks.append(track_of(load_chain('left_leg', 'v1'), times[:1] + 4, positions[:1]))
    recording = Recording(tracks)
    gui = MagicMock()
    recording.add_controls(gui, None)
    for at, knee, version in ((2.4, 0.2, 'v2_5'), (5.0, 0.1, 'v1')):
        gui.add_slider.return_value.value = at
        [posture] = recording.step()
        assert (posture.q[3], recording.chains[0].version) == (knee, version)
