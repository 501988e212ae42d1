"""`leg_fk plot`: pictures from CSV files and bags, what they show, and what is refused."""

import os
from pathlib import Path
import subprocess
import sys
from xml.etree import ElementTree
import zlib

from icub_leg_fk.__main__ import main
from icub_leg_fk.commands.plot import default_instants
from icub_leg_fk.kinematics import Catalog, config_file
from icub_leg_fk.tools.recording import ChainTrack, read_csv
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, leg_fk

pytest.importorskip('matplotlib')
drawing = pytest.importorskip('icub_leg_fk.tools.drawing')

JOINTS = [f'{side}_{joint}' for side in 'lr' for joint in (
    'hip_pitch', 'hip_roll', 'hip_yaw', 'knee', 'ankle_pitch', 'ankle_roll')]


@pytest.fixture(scope='module')
def gait():
    return read_csv(config_file('examples/synthetic_walk.csv'), JOINTS).first(1.99)


@pytest.fixture
def walking_csv(tmp_path, monkeypatch, gait):
    """Return a CSV file with extra columns and another order, in the present directory."""
    monkeypatch.chdir(tmp_path)
    rows = [f'{q[6]},{t:.3f},text,' + ','.join(map(repr, np.delete(q, 6).tolist()))
            for t, q in zip(gait.times, gait.positions, strict=True)]
    header = ','.join([JOINTS[6], 'time', 'note', *JOINTS[:6], *JOINTS[7:]])
    file = tmp_path / 'walking.csv'
    file.write_text('\n'.join([header, *rows]) + '\n')
    return file


@pytest.fixture
def tracks(gait):
    return [gait.track(Catalog.load().chain(name, 'v2_5')) for name in ('left_leg', 'right_leg')]


def write_bag(path, messages, **options):
    """Write messages (stamp [s], names, positions), skipping the test without rosbags."""
    from support import bag_files
    joints = [(round(stamp * 1e9), bag_files.joint_state(round(stamp * 1e9), names, positions))
              for stamp, names, positions in messages]
    return bag_files.write_bag(path, joints=joints, others=False, **options)


def texts_in(svg):
    """Return the texts of an SVG, which are text and not outlines."""
    return [element.text for element in ElementTree.parse(svg).iter() if element.tag.endswith(
        '}text')]


def test_default_name_is_the_inputs_in_the_present_directory(walking_csv, tmp_path, monkeypatch):
    (tmp_path / 'elsewhere').mkdir()
    monkeypatch.chdir(tmp_path / 'elsewhere')
    assert main(['plot', '../walking.csv']) == 0
    assert Path('walking.png').is_file()


def test_same_input_gives_the_same_file(walking_csv):
    for name in ('one.svg', 'two.svg', 'one.pdf', 'two.pdf'):
        assert main(['plot', 'walking.csv', '-o', name]) == 0
    for ending in ('svg', 'pdf'):
        one, two = (Path(f'{name}.{ending}').read_bytes() for name in ('one', 'two'))
        assert zlib.crc32(one) == zlib.crc32(two), ending


def test_curves_are_the_poses_of_the_chains(tracks):
    figure = drawing.feet_figure(tracks, [0.5, 1.0], 'walk', {})
    for panel, row in zip(figure.axes, (2, 0, 1)):
        for track, curve in zip(tracks, panel.lines):
            T = np.array([track.chain.forward(q) for q in track.positions])
            assert np.allclose(curve.get_ydata(), T[:, row, 3])
            assert np.array_equal(curve.get_xdata(), track.times)


def test_joints_outside_their_ranges_are_found_with_limit_and_time(tracks):
    q = tracks[1].positions.copy()
    q[50:60, 3] = np.radians(5)  # knee -124 .. 4
    q[70, 4] = np.radians(-36)  # ankle pitch -35 .. 35
    (knee, spans), (ankle, moment) = drawing.outside_ranges(
        ChainTrack(tracks[1].chain, tracks[1].times, q))
    assert (knee, ankle) == ('r_knee > 4°', 'r_ankle_pitch < \N{MINUS SIGN}35°')
    assert np.allclose(spans, [(0.5, 0.6)])
    assert np.allclose(moment, [(0.7, 0.71)])
    assert drawing.outside_ranges(tracks[1]) == []


def test_gaps_break_the_curve(tracks):
    keep = np.r_[0:80, 120:200]
    cut = [ChainTrack(t.chain, t.times[keep], t.positions[keep]) for t in tracks]
    assert np.allclose(drawing.gaps(cut), [(0.79, 1.2)])
    assert drawing.gaps(tracks) == []
    curve = drawing.feet_figure(cut, [0.5], 'walk', {}).axes[0].lines[0]
    assert np.flatnonzero(np.isnan(curve.get_ydata())).tolist() == [80]


def test_a_long_recording_is_a_band_from_its_lowest_to_its_highest_values(tracks):
    q = np.tile(tracks[0].positions, (500, 1))
    q[12_345, 3] = -2.0
    times = np.arange(len(q)) / 100
    times[60_000:] += 20.0  # a gap
    long = ChainTrack(tracks[0].chain, times, q)
    lowest, highest = drawing.feet_figure([long], [1.0], 'walk', {}).axes[0].lines[:2]
    z = long.poses[:, 2]
    assert np.nanmin(lowest.get_ydata()) == z.min()
    assert np.nanmax(highest.get_ydata()) == z.max() == z[12_345]
    assert len(lowest.get_xdata()) < 1000
    [hole] = np.flatnonzero(np.isnan(lowest.get_ydata()))
    assert 595 < lowest.get_xdata()[hole - 1] < 600 and 620 < lowest.get_xdata()[hole + 1] < 625


def test_from_and_to_cut_the_recording(walking_csv, capsys):
    assert main(['plot', 'walking.csv', '--from', '0.5', '--to', '1.2', '-o', 'cut.svg']) == 0
    assert '71 poses of left_foot, 71 poses of right_foot' in capsys.readouterr().out
    assert {'walking.csv   v2_5', 'left foot', 'right foot'} <= set(texts_in('cut.svg'))


def test_axes_are_named_and_text_is_text(walking_csv):
    assert main(['plot', 'walking.csv', '-o', 'feet.svg', '--at', '0.5']) == 0
    texts = texts_in('feet.svg')
    for name in 'xyz':  # of the root and of both feet
        assert texts.count(name) == 3
    assert 'z in root_link [m]' in texts and 'time [s]' in texts
    assert main(['plot', 'walking.csv', '-o', 'feet.pdf']) == 0
    pdf = Path('feet.pdf').read_bytes()
    assert b'/Type3' not in pdf.replace(b' ', b'') and b'/CIDFontType2' in pdf


@pytest.mark.parametrize('backend', ['module://nonsense', 'nonsense'])
def test_nothing_of_the_users_matplotlib_settings_is_taken(walking_csv, backend):
    assert main(['plot', 'walking.csv', '-o', 'plain.svg']) == 0
    Path('matplotlibrc').write_text('text.usetex: true\naxes.facecolor: black\n'
                                    'text.color: white\n')
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, '-m', 'icub_leg_fk', 'plot', 'walking.csv', '-o', 'theirs.svg'],
        capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': root, 'MPLBACKEND': backend})
    assert (done.returncode, done.stderr) == (0, '')
    assert Path('theirs.svg').read_text() == Path('plain.svg').read_text()


def test_default_instants_show_each_foot_lifted_and_ahead(tracks):
    left, right = (track.poses for track in tracks)
    rows = [round(instant * 100) for instant in default_instants(tracks)]
    apart = (left - right)[rows]
    assert len(rows) == 4
    assert apart[:, 2].max() > 0.035
    assert apart[:, 2].min() < -0.035
    assert apart[:, 0].max() > 0.1
    assert apart[:, 0].min() < -0.1


@pytest.mark.parametrize(('storage', 'compression'), [
    ('mcap', None), ('sqlite3', 'FILE'), ('mcap', 'MESSAGE')])
def test_bags_give_the_same_picture_as_csv(walking_csv, tmp_path, gait, storage, compression):
    messages = [(1e9 + t, gait.joint_names, q)
                for t, q in zip(gait.times, gait.positions, strict=True)]
    bag = tmp_path / 'walking.bag2'
    write_bag(bag, messages, storage=storage, compression=compression)
    assert main(['plot', str(bag), '-o', 'bag.svg', '--at', '0.5,1']) == 0
    assert main(['plot', 'walking.csv', '-o', 'csv.svg', '--at', '0.5,1']) == 0
    bag_svg, csv_svg = (Path(name).read_text() for name in ('bag.svg', 'csv.svg'))
    assert bag_svg.count('<path') == csv_svg.count('<path') > 100


def test_bag_is_read_by_the_nodes_rules(tmp_path, monkeypatch, gait, capsys):
    """One publisher per leg, reordered; short, repeated and NaN ones give no pose."""
    monkeypatch.chdir(tmp_path)
    messages = []
    for t, q in zip(gait.times, gait.positions, strict=True):
        messages.append((t + 1.0, gait.joint_names[:6][::-1], q[:6][::-1]))
        messages.append((t + 1.002, (*gait.joint_names[6:], 'neck'), [*q[6:], 0.0]))
    q = gait.positions[0]
    messages += [(3.1, gait.joint_names, q[:5]), (3.2, ('l_knee', 'l_knee'), q[:2]),
                 (3.3, gait.joint_names, [np.nan, *q[1:]])]
    write_bag(tmp_path / 'bag', messages, topic='/legs')
    assert main(['plot', 'bag']) == 0
    assert f'{len(gait.times)} poses of left_foot' in (out := capsys.readouterr().out)
    assert f'{len(gait.times) + 1} poses of right_foot' in out


def test_bag_with_one_leg_draws_that_and_says_so(tmp_path, monkeypatch, gait, capsys):
    monkeypatch.chdir(tmp_path)
    write_bag(tmp_path / 'bag', [(t + 1, gait.joint_names[:6], q[:6]) for t, q in zip(
        gait.times, gait.positions, strict=True)])
    assert main(['plot', 'bag']) == 0
    captured = capsys.readouterr()
    assert 'left_foot' in captured.out
    assert 'right_foot' not in captured.out
    assert 'r_hip_pitch' in captured.err
    assert captured.err.count('\n') == 1


def test_any_chain_of_any_file_can_be_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    joints = Catalog.load().chain('head_imu', 'v2').joint_names
    Path('head.csv').write_text('\n'.join(
        [','.join(['time', *joints]), *(f'{t},0.1,0,{t / 10},0,0.2,0' for t in range(9))]))
    assert main(['plot', 'head.csv', '--chains', 'head_imu', '--version', 'v2']) == 0
    assert Path('head.png').stat().st_size > 10_000


def test_existing_picture_is_replaced_only_when_forced(walking_csv, capsys):
    Path('walking.png').write_text('mine')
    assert main(['plot', 'walking.csv']) == 2
    assert Path('walking.png').read_text() == 'mine'
    assert '--force' in capsys.readouterr().err
    assert main(['plot', 'walking.csv', '--force']) == 0
    assert Path('walking.png').read_bytes().startswith(b'\x89PNG')


def test_failed_picture_leaves_nothing_behind(walking_csv, monkeypatch):
    from matplotlib.figure import Figure

    def fail(*args, **kwargs):
        raise OSError(28, 'No space left on device')
    monkeypatch.setattr(Figure, 'savefig', fail)
    assert main(['plot', 'walking.csv']) == 2
    assert [path.name for path in Path().iterdir()] == ['walking.csv']


@pytest.mark.parametrize(('words', 'named'), [
    (['nowhere.csv'], ['nowhere.csv']),
    (['walking.csv', '-o', 'feet.bmp'], ['.bmp', '.png, .svg, .pdf']),
    (['walking.csv', '-o', 'none/feet.png'], ['none/feet.png', 'directory']),
    (['walking.csv', '--version', 'v9'], ['v9', 'v2_5']),
    (['walking.csv', '--foot-frame', 'toe'], ['toe', 'sole']),
    (['walking.csv', '--chains', 'arm'], ['arm', 'left_leg']),
    (['walking.csv', '--at', '1,x'], ['1,x']),
    (['walking.csv', '--at', '1,2,3,4,5'], ['1,2,3,4,5', '4']),
    (['walking.csv', '--at', '7'], ['7 s', '0 to 1.99 s']),
    (['walking.csv', '--from', 'x'], ['--from', "'x'"]),
    (['walking.csv', '--from', '3'], ['3 to 1.99 s', '0 to 1.99 s']),
    (['walking.csv', '--from', '1', '--to', '0.5'], ['1 to 0.5 s']),
    (['walking.csv', '--joint-topic', '/legs'], ['--joint-topic', 'CSV']),
    (['walking.csv', '-k', 'no.yaml'], ['no.yaml']),
    (['empty.csv'], ['empty.csv:1', 'header']),
    (['header.csv'], ['header.csv', 'rows']),
    (['missing.csv'], ['missing.csv:1', 'column l_knee']),
    (['untimed.csv'], ['untimed.csv:1', 'column of times']),
    (['twice.csv'], ['twice.csv:1', 'column r_knee', 'twice']),
    (['text.csv'], ['text.csv:4', 'column r_hip_roll', "'soon'"]),
    (['nan.csv'], ['nan.csv:5', 'column time', "'nan'"]),
    (['short.csv'], ['short.csv:6', '12 values under 14 columns']),
    (['long.csv'], ['long.csv:6', '15 values under 14 columns']),
    (['huge.csv'], ['huge.csv:7', 'column r_hip_roll', "'1e300'", 'up to 1e+09']),
    (['unsorted.csv'], ['unsorted.csv:8', 'column time', '0.05 after 0.06']),
    (['binary.csv'], ['binary.csv', 'CSV']),
    (['broken.mcap'], ['broken.mcap', 'read']),
    (['emptydir'], ['emptydir', 'bag']),
])
def test_bad_input_is_one_line_and_exit_2(walking_csv, capsys, words, named):
    spoil(walking_csv)
    assert main(['plot', *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.count('\n') == 1
    for word in named:
        assert word in captured.err
    assert not list(Path().glob('*.png'))


def spoil(good):
    """Write one bad file of each kind beside a good CSV file."""
    lines = good.read_text().splitlines()
    header = lines[0].split(',')

    def without(name):
        index = header.index(name)
        return [','.join(w for i, w in enumerate(line.split(',')) if i != index)
                for line in lines]

    def edited(line, column, text):
        words = lines[line - 1].split(',')
        words[header.index(column)] = text
        return [*lines[:line - 1], ','.join(words), *lines[line:]]

    at_r_knee = header.index('r_knee')
    files = {
        'empty': [], 'header': lines[:1], 'missing': without('l_knee'), 'untimed': without('time'),
        'twice': [f'{line},{line.split(",")[at_r_knee]}' for line in lines],
        'text': edited(4, 'r_hip_roll', 'soon'), 'nan': edited(5, 'time', 'nan'),
        'short': [*lines[:5], ','.join(lines[5].split(',')[:12]), *lines[6:]],
        'long': [*lines[:5], f'{lines[5]},1', *lines[6:]],
        'huge': edited(7, 'r_hip_roll', '1e300'),
        'unsorted': [*lines[:6], lines[7], lines[6], *lines[8:]],
    }
    for name, content in files.items():
        good.with_name(f'{name}.csv').write_text('\n'.join(content))
    good.with_name('binary.csv').write_bytes(b'\xff\xfe\x00\x01' * 100)
    good.with_name('broken.mcap').write_bytes(b'\x89MCAP0\r\n' + b'nothing' * 9)
    good.with_name('emptydir').mkdir()


def test_bag_without_joint_states_lists_what_it_has(tmp_path, monkeypatch, gait, capsys):
    monkeypatch.chdir(tmp_path)
    write_bag(tmp_path / 'bag', [(1.0, gait.joint_names, gait.positions[0])], topic='/legs')
    assert main(['plot', 'bag', '--joint-topic', '/joint_states']) == 2
    assert '/legs' in capsys.readouterr().err


def test_matplotlibrc_that_is_no_text_is_one_line(walking_csv):
    Path('matplotlibrc').write_bytes(b'# r\xe9glages')
    assert_one_line_complaint(leg_fk('plot', walking_csv), 'is there a file matplotlibrc in this')


def test_degrees_in_a_recording_are_warned_of(walking_csv, capsys, gait):
    Path('degrees.csv').write_text('\n'.join([','.join(['time', *gait.joint_names]), *(
        ','.join(map(str, [time, *np.degrees(angles)]))
        for time, angles in zip(gait.times, gait.positions))]))
    assert main(['plot', 'degrees.csv']) == 0
    assert 'positions look like degrees, radians are expected: l_hip_p' in capsys.readouterr().err
    assert main(['plot', 'walking.csv']) == 0
    assert capsys.readouterr().err == ''


def test_missing_matplotlib_is_one_line(walking_csv):
    code = ("import sys; sys.modules['matplotlib'] = None\n"
            'from icub_leg_fk.__main__ import main\n'
            "sys.exit(main(['plot', 'walking.csv']))")
    root = str(Path(__file__).parents[2])
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False, env={**os.environ, 'PYTHONPATH': root})
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert 'matplotlib' in done.stderr


def test_pictures_of_the_documentation_can_be_made_anew(tmp_path):
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, root / 'docs' / 'pictures.py', tmp_path], check=True,
                   env={**os.environ, 'PYTHONPATH': str(root)})
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
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 2, d: 0, alpha: 0, offset: 0, range: [-90, 90]}
          - {a: 0, d: 0, alpha: 0, offset: 0, range: [0, 1.5], type: prismatic}
"""


def test_other_robots_have_a_scale_that_fits(tmp_path):
    (tmp_path / 'arm.yaml').write_text(ARM)
    chain = Catalog.load(tmp_path / 'arm.yaml').chain('arm', 'v1')
    track = ChainTrack(chain, np.arange(9.0), np.linspace((0, 0), (1, 2), 9))
    figure = drawing.feet_figure([track], [0.0, 8.0], 'arm', {})
    assert [panel.get_title(loc='left') for panel in figure.axes[:4]] == [
        'z in base [m]', 'x in base [m]', 'y in base [m]', 'outside its range']
    assert np.allclose(figure.axes[1].lines[0].get_ydata(), 2 * np.cos(track.positions[:, 0]))
    assert drawing.outside_ranges(track)[0][0] == 'lift > 1.5 m'
    assert any('squares of 0.5 m' in text.get_text() for text in figure.texts)


def test_chains_of_several_roots_are_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    other = ARM.partition('chains:')[2].replace('arm', 'leg').replace('base', 'hip')
    Path('two.yaml').write_text(ARM + other.replace('gripper', 'foot'))
    Path('two.csv').write_text('time,column,lift\n0,0,0\n')
    assert main(['plot', 'two.csv', '-k', 'two.yaml', '--version', 'v1']) == 2
    assert 'base, hip' in capsys.readouterr().err
