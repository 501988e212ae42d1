"""`leg_fk plot`: pictures from CSV files and bags, what they show, and what is refused."""

import csv
from itertools import combinations
import os
from pathlib import Path
import re
import shlex
import subprocess
import sys
from xml.etree import ElementTree

from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import config_file, load_chain
from icub_leg_fk.tools import drawing
from icub_leg_fk.tools.recording import read_joints
from icub_leg_fk.tools.tracks import read_tracks, track_of
import numpy as np
import pytest
from support.leg_fk_process import (
    assert_one_line_complaint,
    leg_fk,
    run_code,
    run_main,
)

Text = pytest.importorskip('matplotlib.text').Text

ROOT = Path(__file__).parents[2]
LEGS = [load_chain(name) for name in ('left_leg', 'right_leg')]
JOINTS = LEGS[0].joint_names + LEGS[1].joint_names


@pytest.fixture(scope='module')
def gait():
    return read_joints([config_file('examples/synthetic_walk.csv')], LEGS).first(1.99)


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def walking_csv(gait):
    """Return a CSV file with an extra column and another order, in the present directory."""
    order = [6, *range(6), *range(7, 12)]
    rows = [
        [q[6], f'{time:.3f}', 'text', *q[order[1:]]]
        for time, q in zip(gait.times, gait.positions, strict=True)
    ]
    return write_csv(
        'walking.csv',
        [JOINTS[6], 'time', 'note', *(JOINTS[i] for i in order[1:])],
        rows,
    )


@pytest.fixture
def tracks(gait):
    return [track_of(chain, gait.times, gait.positions_of(chain)) for chain in LEGS]


def write_csv(name, header, rows):
    with open(name, 'w', newline='') as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)
    return Path(name)


def write_bag(path, messages, topic='/joint_states', in_order=True):
    """Write messages (stamp [s], names, positions), skipping the test without rosbags."""
    from support import bag_files

    joints = []
    for i, (stamp, names, positions) in enumerate(messages):
        stamp = round(stamp * 1e9)
        data = bag_files.joint_state(stamp, names, positions)
        joints.append((stamp if in_order else i, data))
    return bag_files.write_bag(path, joints=joints, others=False, topic=topic)


def plotted(*words):
    """Draw a picture; return what was printed on stdout and stderr."""
    done = run_main('plot', *words)
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def texts_in(svg):
    """Return the texts of an SVG, which are text and not outlines."""
    elements = ElementTree.parse(svg).iter()
    return [each.text or '' for each in elements if each.tag.endswith('}text')]


def test_default_name_is_the_inputs_in_the_present_directory(walking_csv, monkeypatch):
    Path('elsewhere').mkdir()
    monkeypatch.chdir('elsewhere')
    out = 'walking.png: 200 poses of left_foot, 200 poses of right_foot\n'
    assert plotted('../walking.csv') == (out, '')
    assert Path('walking.png').is_file()


@pytest.mark.parametrize('ending', ['svg', 'pdf'])
def test_same_input_gives_the_same_file(walking_csv, ending):
    for name in ('one', 'two'):
        plotted('walking.csv', '-o', f'{name}.{ending}')
    assert Path(f'one.{ending}').read_bytes() == Path(f'two.{ending}').read_bytes()


def test_curves_are_the_poses_of_the_chains(tracks):
    figure = drawing.feet_figure(tracks, [0.5, 1.0], 'walk')
    for panel, row in zip(figure.axes, (2, 0, 1)):
        for track, curve in zip(tracks, panel.lines):
            T = track.chain.forward(track.positions)
            assert np.allclose(curve.get_ydata(), T[:, row, 3])
            assert np.array_equal(curve.get_xdata(), track.times)


def test_joints_outside_their_ranges_are_found_with_limit_and_time(tracks):
    q = tracks[1].positions.copy()
    q[50:60, 3] = np.radians(5)  # knee -124 .. 4
    q[70, 4] = np.radians(-36)  # ankle pitch -35 .. 35
    knee, ankle = track_of(LEGS[1], tracks[1].times, q).outside
    assert drawing.range_end(knee) == 'r_knee > 4°'
    assert drawing.range_end(ankle) == 'r_ankle_pitch < \N{MINUS SIGN}35°'
    assert np.allclose(knee.spans, [(0.5, 0.6)])
    assert np.allclose(ankle.spans, [(0.7, 0.71)])
    assert tracks[1].outside == []


def test_gaps_and_steps_back_break_the_curve(tracks):
    for late, gaps in ((0.4, [(0.79, 1.2)]), (-0.6, [])):
        cut = [with_gap(track, late) for track in tracks]
        for track in cut:
            assert np.allclose(track.gaps, gaps)
            assert track.breaks.tolist() == [80]
        curve = drawing.feet_figure(cut, [0.5], 'walk').axes[0].lines[0]
        assert np.flatnonzero(np.isnan(curve.get_ydata())).tolist() == [80]
    assert tracks[0].gaps == []


def test_a_long_recording_is_a_band_from_its_lowest_to_its_highest_values(tracks):
    q = np.tile(tracks[0].positions, (500, 1))
    q[12_345, 3] = -2.0
    times = np.arange(len(q)) / 100
    times[60_000:] += 20.0  # a gap
    long = track_of(tracks[0].chain, times, q)
    lowest, highest = drawing.feet_figure([long], [1.0], 'walk').axes[0].lines[:2]
    z = long.chain.poses(q)[:, 2]
    assert np.nanmin(lowest.get_ydata()) == z.min()
    assert np.nanmax(highest.get_ydata()) == z.max() == z[12_345]
    seconds = lowest.get_xdata()
    assert len(seconds) < 1000
    [hole] = np.flatnonzero(np.isnan(lowest.get_ydata()))
    assert 595 < seconds[hole - 1] < 600
    assert 620 < seconds[hole + 1] < 625


def test_from_and_to_cut_the_recording_and_what_is_drawn_is_named(walking_csv):
    out, _ = plotted(
        'walking.csv', '--from', '0.5', '--to', '1.2', '-o', 'cut.svg', '--at', '1'
    )
    assert '71 poses of left_foot, 71 poses of right_foot' in out
    texts = texts_in('cut.svg')
    assert {
        'walking.csv   v2_5',
        'left foot',
        'right foot',
        'z (up) in root_link [m]',
        'x (backward) in root_link [m]',
        'path of a tip, 0.5 s before and after',
        'time [s]',
    } <= set(texts)
    for name in 'xyz':  # of the root, and of the feet where there is room
        assert 1 <= texts.count(name) <= 3


def test_nothing_of_the_users_matplotlib_settings_is_taken(walking_csv):
    plotted('walking.csv', '-o', 'plain.svg')
    Path('matplotlibrc').write_text(
        'text.usetex: true\naxes.facecolor: black\ntext.color: white\n'
    )
    done = leg_fk(
        'plot',
        'walking.csv',
        '-o',
        'theirs.svg',
        environment={'PYTHONPATH': str(ROOT), 'MPLBACKEND': 'module://nonsense'},
    )
    assert (done.returncode, done.stderr) == (0, '')
    assert Path('theirs.svg').read_text() == Path('plain.svg').read_text()
    Path('matplotlibrc').write_bytes(b'# r\xe9glages')
    done = leg_fk('plot', walking_csv, '--force', environment={'PYTHONPATH': str(ROOT)})
    assert_one_line_complaint(done, 'is there a file matplotlibrc in this')


def test_default_instants_show_each_foot_lifted_and_ahead(tracks):
    left, right = (track.poses for track in tracks)
    rows = [round(instant * 100) for instant in default_instants(tracks)]
    apart = (left - right)[rows]
    assert len(rows) == 4
    assert apart[:, 2].max() > 0.035
    assert apart[:, 2].min() < -0.035
    assert apart[:, 0].max() > 0.1
    assert apart[:, 0].min() < -0.1


def test_bags_give_the_same_picture_as_csv(walking_csv, gait):
    rows = zip(gait.times, gait.positions, strict=True)
    write_bag('walking', [(1e9 + t, gait.joint_names, q) for t, q in rows])
    texts = []
    for name in ('walking', 'walking.csv'):
        plotted(name, '-o', 'x.svg', '--at', '0.5,1', '--force')
        texts.append(Path('x.svg').read_text().replace(name, 'walking'))
    assert texts[0] == texts[1]


def test_bag_is_read_by_the_nodes_rules(gait):
    """One publisher per leg, reordered; short, repeated and NaN ones give no pose."""
    messages = []
    for t, q in zip(gait.times, gait.positions, strict=True):
        messages.append((t + 1.0, JOINTS[:6][::-1], q[:6][::-1]))
        messages.append((t + 1.002, (*JOINTS[6:], 'neck'), [*q[6:], 0.0]))
    q = gait.positions[0]
    messages += [
        (3.1, JOINTS, q[:5]),
        (3.2, ('l_knee', 'l_knee'), q[:2]),
        (3.3, JOINTS, [np.nan, *q[1:]]),
    ]
    write_bag('bag', messages, topic='/legs')
    out, errors = plotted('bag')
    assert out == 'bag.png: 200 poses of left_foot, 201 poses of right_foot\n'
    for words in (
        'position has 5 values',
        "name 'l_knee' appears twice",
        'l_hip_pitch nan',
    ):
        assert words in errors


def test_bag_with_one_leg_draws_that_and_says_so(gait):
    rows = zip(gait.times, gait.positions, strict=True)
    write_bag('bag', [(t + 1, JOINTS[:6], q[:6]) for t, q in rows])
    out, errors = plotted('bag')
    assert out == 'bag.png: 200 poses of left_foot\n'
    assert 'right_leg has no pose' in errors and 'r_hip_pitch' in errors
    assert errors.count('\n') == 1


def test_any_chain_of_any_file_can_be_drawn():
    joints = load_chain('head_imu', 'v2').joint_names
    rows = [(t, 0.1, 0, t / 10, 0, 0.2, 0) for t in range(9)]
    write_csv('head.csv', ['time', *joints], rows)
    assert '9 poses of head_imu' in plotted('head.csv', '--chains', 'head_imu=v2')[0]


def test_existing_picture_is_replaced_only_when_forced(walking_csv):
    Path('walking.png').write_text('mine')
    assert_one_line_complaint(run_main('plot', 'walking.csv'), '--force')
    assert Path('walking.png').read_text() == 'mine'
    plotted('walking.csv', '--force')
    assert Path('walking.png').read_bytes().startswith(b'\x89PNG')


def test_failed_picture_leaves_nothing_behind(walking_csv, monkeypatch):
    from matplotlib.figure import Figure

    def fail(*args, **kwargs):
        raise OSError(28, 'no space left on device')

    monkeypatch.setattr(Figure, 'savefig', fail)
    assert_one_line_complaint(
        run_main('plot', 'walking.csv'), 'no space left on device'
    )
    assert [path.name for path in Path().iterdir()] == ['walking.csv']


WRONG = {  # words of a command, and of its answer
    'nowhere.csv': 'nowhere.csv: there is no such file',
    "''": "argument RECORDING: found ''",
    "walking.csv -o ''": "'': is not the name of a file",
    'loop': 'loop: is a loop of links',
    'walking.csv -o feet.bmp': 'found .bmp, allowed: .png, .svg, .pdf',
    'walking.csv -o none/feet.png': 'none/feet.png: there is no directory',
    'walking.csv -o -': '-: is standard output',
    'walking.csv --output=-1.png': './-1.png',
    'walking.csv --version v9': "unknown version 'v9' of chain left_leg; known: v1, v2_5",
    'walking.csv --foot-frame toe': "found 'toe', allowed: dh or sole",
    'walking.csv --chains arm': "unknown chain 'arm'; known: left_leg",
    'walking.csv --chains left_leg=v3 right_leg': 'left_leg=v3 and right_leg=v2_5',
    'walking.csv --over nowhere.csv': 'nowhere.csv',
    'walking.csv --at 1,x': "'1,x'",
    'walking.csv --at 1,2,3,4,5': "'1,2,3,4,5', allowed: up to 4",
    'walking.csv --at 7': '7 s, where there is no pose; allowed: 0 to 1.99 s',
    'walking.csv --from x': "argument --from: found 'x'",
    'walking.csv --from 3': '3 to 1.99 s, in which not every chain has a pose; the '
    'recording goes from 0 to 1.99 s',
    'walking.csv --from 1 --to 0.5': '1 to 0.5 s',
    'walking.csv --joint-topic /legs': '--joint-topic: walking.csv has no topics',
    'walking.csv -k no.yaml': 'no.yaml',
    'broken.mcap': 'broken.mcap: cannot be read',
    'emptydir': 'emptydir: cannot be read: it has no metadata.yaml',
}


@pytest.mark.parametrize('words', WRONG)
def test_bad_input_is_one_line_and_exit_2(walking_csv, words):
    Path('broken.mcap').write_bytes(b'\x89MCAP0\r\n' + b'nothing' * 9)
    Path('emptydir').mkdir()
    Path('loop').symlink_to('loop')
    assert_one_line_complaint(run_main('plot', *shlex.split(words)), WRONG[words])
    assert not list(Path().glob('*.png'))


def test_a_name_that_is_no_text_is_drawn_all_the_same(walking_csv):
    odd = walking_csv.rename(os.fsdecode(b'caf\xe9.csv'))
    plotted(odd, '-o', 'odd.svg')
    assert 'caf\\xe9.csv   v2_5' in texts_in('odd.svg')


def test_missing_matplotlib_is_one_line(walking_csv):
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        'from icub_leg_fk.__main__ import main\n'
        "sys.exit(main(['plot', 'walking.csv']))"
    )
    done = run_code(code, environment={'PYTHONPATH': str(ROOT)})
    assert_one_line_complaint(done, 'pip install matplotlib')


def test_pictures_of_the_documentation_can_be_made_anew(tmp_path):
    subprocess.run(
        [sys.executable, ROOT / 'docs' / 'pictures.py', tmp_path],
        check=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)},
    )
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert sizes.keys() == {'frames.png', 'walking.png'}
    assert all(20_000 < size < 300_000 for size in sizes.values())


ARM = """
units: {length: m, angle: deg}
chains:
  arm:
    tip: gripper
    root_frame: base
    joints: [column, lift]
    tip_frames: {dh: {frame: gripper}}
    versions:
      v1:
        links:
          - {a: 2, d: 0, alpha: 0, range: [-90, 90]}
          - {a: 0, d: 0, alpha: 0, range: [0, 1.5], type: prismatic}
"""


def an_arm(text):
    Path('arm.yaml').write_text(text)
    return load_chain('arm', file='arm.yaml')


def test_other_robots_have_a_scale_that_fits():
    chain = an_arm(ARM)
    q = np.linspace((0, 0), (1, 2), 9)
    track = track_of(chain, np.arange(9.0), q)
    figure = drawing.feet_figure([track], [0.0, 8.0], 'arm')
    assert [panel.get_title(loc='left') for panel in figure.axes[:4]] == [
        'z in base [m]',
        'x in base [m]',
        'y in base [m]',
        'outside its range',
    ]
    assert np.allclose(
        figure.axes[1].lines[0].get_ydata(), 2 * np.cos(track.positions[:, 0])
    )
    assert drawing.range_end(track.outside[0]) == 'lift > 1.5 m'
    assert any('squares of 0.5 m' in text.get_text() for text in figure.texts)


def still(chain, count, q=0.0):
    """Return the track of a chain that does not move."""
    return track_of(chain, np.arange(count) / 100, np.full((count, chain.n), q))


def with_gap(track, late):
    """Return a track of which the samples from 0.8 s on come later."""
    times = track.times + np.where(track.times < 0.795, 0.0, late)
    return track_of(track.chain, times, track.positions)


def odd_pictures(tracks):
    """Yield settings of pictures in which texts are many, long or close to each other."""
    arm = an_arm(ARM.replace('gripper', 'g' * 60))
    yield 'walk', tracks, {}
    yield 'one leg', tracks[:1], {'instants': [0.0]}
    yield 'x' * 120, tracks, {'orientation': True}
    yield 'over', tracks, {'over': tracks, 'over_name': 'y' * 60, 'orientation': True}
    yield 'near', tracks, {'instants': [1.96, 1.97, 1.98, 1.99]}
    yield (
        'gap',
        [with_gap(track, 40.0) for track in tracks],
        {'instants': [0.1, 0.2, 41.6, 41.7]},
    )
    yield (
        'degrees',
        [still(chain, 30, 60.0) for chain in LEGS],
        {'instants': [0.0, 0.1]},
    )
    yield 'folded', [still(chain, 30, 2.0) for chain in LEGS], {'instants': [0.0, 0.1]}
    yield 'sample', [still(chain, 1) for chain in LEGS], {'instants': [0.0]}
    yield 'other root', [still(arm, 9, 1.0)], {'instants': [0.0], 'orientation': True}
    hour = np.tile(tracks[0].positions, (50, 1))
    long = track_of(LEGS[0], 1e5 + np.arange(len(hour)) / 100, hour)
    yield 'long', [long, track_of(LEGS[1], long.times, hour)], {'instants': [1e5 + 20]}


def test_no_text_is_outside_the_picture_or_over_another(tracks, monkeypatch):
    shown = {}
    draw = Text.draw

    def note(text, renderer, *args):
        if text.get_visible() and text.get_text().strip():
            shown[text] = text.get_window_extent(renderer)
        draw(text, renderer, *args)

    monkeypatch.setattr(Text, 'draw', note)
    for title, drawn, settings in odd_pictures(tracks):
        shown.clear()
        instants = settings.pop('instants', [0.5, 0.9, 1.3, 1.7])
        with drawing.own_settings():
            figure = drawing.feet_figure(drawn, instants, title, **settings)
            figure.canvas.draw()
        canvas = figure.bbox
        assert len(shown) > 10
        for text, box in shown.items():
            is_inside = canvas.contains(*box.min) and canvas.contains(*box.max)
            assert is_inside, (title, text.get_text())
        for (one, first), (two, second) in combinations(shown.items(), 2):
            is_over = first.shrunk(0.98, 0.9).overlaps(second)
            assert not is_over, (title, one.get_text(), two.get_text())


def test_two_feet_at_one_place_are_both_seen(tracks):
    figure = drawing.feet_figure([tracks[0], tracks[0]], [0.5], 'walk')
    *_, above = figure.axes[0].lines[:3]
    assert above.is_dashed()
    assert np.array_equal(above.get_ydata(), figure.axes[0].lines[0].get_ydata())


def test_orientation_is_that_from_the_posture_at_zero():
    """A turn of the ankle roll joint by 10 deg is one of the foot about its own axis."""
    q = np.zeros((3, 6))
    q[1:, 5] = np.radians([10, -10])
    track = track_of(LEGS[0], np.arange(3.0), q)
    figure = drawing.feet_figure([track], [0.0], 'walk', orientation=True)
    curves = [panel.lines[0].get_ydata() for panel in figure.axes[3:6]]
    T = LEGS[0].forward(q)
    R = T[:, :3, :3] @ T[0, :3, :3].T
    roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    pitch = np.arcsin(-R[:, 2, 0])
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    assert np.allclose(curves, np.degrees([roll, pitch, yaw]))
    assert np.abs(curves).max() == pytest.approx(10)
    assert figure.axes[3].get_title(loc='left').startswith('roll about x (backward)')


def test_another_recording_is_drawn_below(walking_csv):
    other = walking_csv.with_name('other.csv')
    other.write_text(walking_csv.read_text())
    _, errors = plotted(
        'walking.csv', '--over', 'other.csv', '-o', 'both.svg', '--orientation'
    )
    assert errors == ''
    texts = texts_in('both.svg')
    assert 'walking.csv   v2_5   over   other.csv   v2_5' in texts
    assert {
        'left foot',
        'left foot, other.csv',
        'yaw about z (up) from q = 0 [°]',
    } <= set(texts)


def test_legs_are_drawn_only_where_poses_are():
    times = np.array([*np.arange(50) / 100, *(40.5 + np.arange(100) / 100)])
    rows = [[time, *(0.05 * np.sin(time + np.arange(12)))] for time in times]
    write_csv('gap.csv', ['time', *JOINTS], rows)
    plotted('gap.csv', '-o', 'gap.svg')
    titles = re.findall(r'\n[ABCD]  ([\d.]+) s\n', '\n\n'.join(texts_in('gap.svg')))
    assert len(titles) == 4
    for title in titles:
        assert abs(float(title) - times).min() < 0.01
    plotted('gap.csv', '-o', 'at.svg', '--at', '0.201,41')
    assert {'A  0.20 s', 'B  41.00 s'} <= set(texts_in('at.svg'))
    assert_one_line_complaint(
        run_main('plot', 'gap.csv', '-o', 'x.svg', '--at', '20'),
        '--at: found 20 s, where there is no pose; allowed: 0 to 0.49 s, 40.5 to 41.49',
    )


def test_a_clock_that_steps_back_is_reported():
    stamps = [10.0 + 0.01 * (i if i < 50 else i - 40) for i in range(100)]
    q = [-0.01 * i for i in range(12)]
    write_bag('bag', [(stamp, JOINTS, q) for stamp in stamps], in_order=False)
    write_csv('walk.csv', ['time', *JOINTS], [[stamp, *q] for stamp in stamps])
    for source in ('bag', 'walk.csv'):
        _, errors = plotted(source)
        assert 'time stepped back to 10.100 s' in errors
        for track in read_tracks([source], LEGS).tracks:
            assert (track.count, track.breaks.tolist()) == (100, [50])


def test_chains_of_several_roots_are_refused():
    other = ARM.partition('chains:')[2].replace('arm', 'leg').replace('base', 'hip')
    Path('two.yaml').write_text(ARM + other.replace('gripper', 'foot'))
    write_csv('two.csv', ['time', 'column', 'lift'], [(0, 0, 0)])
    assert_one_line_complaint(
        run_main('plot', 'two.csv', '-k', 'two.yaml'), 'base, hip'
    )
