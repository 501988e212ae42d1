"""Each kind of mistake in a kinematics file ends in one line: where, what, and what instead."""

from pathlib import Path
import re
import tempfile

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.errors import CatalogError
from icub_leg_fk.kinematics import Catalog, yaml_fields
import pytest
import yaml

GOOD = """\
units: {length: mm, angle: deg}
chains:
  leg:
    tip: foot
    root_frame: root_link
    joints: [hip, knee]
    tip_frames:
      dh: {frame: foot_dh}
      sole:
        frame: foot_sole
        transform: [[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]
    versions:
      v1:
        source: "somewhere"
        T_Ro0:
          - [1, 0, 0, 5]
          - [0, 0, 1, -68.1]
          - [0, -1, 0, -119.9]
          - [0, 0, 0, 1]
        links:
          - {a: 10, d: 20, alpha: -90, offset: 90, range: [-44, 132]}
          - {a: 30, d: 40, alpha: 180, offset: 0, type: prismatic, erratum: "odd"}
          - {a: 1, d: 6.6, alpha: 90, offset: 0, type: fixed}
        T_nIs: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""
DH = 'a, d, alpha, offset'
LINK = f'{DH}, range, robot_range, sign, type, erratum'
NUMBER_MM, NUMBER_DEG = 'a finite number (mm)', 'a finite number (deg, or as in pi/2)'
RIGID = 'a rotation (to four decimals at least), a translation and the last row 0 0 0 1'
NAME = 'up to 100 letters, digits and _ . / -'
FRAME = f'{NAME}, not beginning with /'
WORD = 'a letter, then up to 63 letters, digits and _'
FILE, LEG, V1 = 'kinematics file', 'chain leg', 'chain leg, version v1'
VERSION = 'T_Ro0, links, T_nIs, convention, source, root_frame, joints, tip_frames'
ROW_0, ROW_1 = f'{V1}, row 0', f'{V1}, row 1'


@pytest.fixture(params=['CBaseLoader', 'BaseLoader'])
def _loader(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read with libyaml, and without it, as where PyYAML was built so."""
    if not hasattr(yaml, request.param):
        pytest.skip('this PyYAML has no libyaml')
    monkeypatch.setattr(yaml_fields, 'Loader', getattr(yaml, request.param))


def refusal(path: Path) -> CatalogError:
    with pytest.raises(CatalogError) as error:
        Catalog.load(path)
    text = str(error.value)
    assert text.isprintable() and len(text) < 600
    return error.value


def write(tmp_path: Path, content: str | bytes) -> Path:
    file = tmp_path / 'robot.yaml'
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


# What to replace in the good file, by what; then line, place, found and allowed.
MISTAKES = {
    # --- units
    'unknown length unit': ('length: mm', 'length: inch', 1,
                            f'{FILE}, field units, field length', "'inch'", 'mm or m'),
    'no unit': ('{length: mm, angle: deg}', '{length: mm}', 1,
                f'{FILE}, field units, field angle', 'nothing', 'all of length, angle'),
    'units are no mapping': ('{length: mm, angle: deg}', 'mm', 1, f'{FILE}, field units',
                             "'mm'", 'a mapping with length, angle'),
    # --- structure
    'unknown top key': ('units:', 'unit:', 1, FILE,
                        "unknown key 'unit' (did you mean 'units'?)", 'units, chains'),
    'no chains': (GOOD[GOOD.index('chains'):], '', 1, f'{FILE}, field chains', 'nothing',
                  'all of units, chains'),
    'empty chains': (GOOD[GOOD.index('chains'):], 'chains: {}', 2, f'{FILE}, field chains',
                     'none', 'at least one chain'),
    'chains is a list': (GOOD[GOOD.index('chains'):], 'chains: [leg]', 2,
                         f'{FILE}, field chains', 'a list', 'chains by name'),
    'chain name is no word': ('  leg:', '  my-leg:', 3, f'{FILE}, field chains', "'my-leg'",
                              f'a name: {WORD}'),
    'chain twice': (GOOD, GOOD + '  leg: {}\n', 25, LEG, 'a duplicate key', 'each key once'),
    'unknown chain key': ('root_frame:', 'root:', 5, LEG, "unknown key 'root'",
                          'tip, root_frame, joints, tip_frames, versions'),
    'key twice': ('tip: foot', 'tip: foot\n    tip: foot', 5, f'{LEG}, field tip',
                  'a duplicate key', 'each key once'),
    # --- names
    'tip is no word': ('tip: foot', 'tip: left foot', 4, f'{LEG}, field tip', "'left foot'",
                       f'a name: {WORD}'),
    'frame with a space': ('root_link', 'root link', 5, f'{LEG}, field root_frame',
                           "'root link'", f'a frame id: {FRAME}'),
    'joint name of several lines': ('[hip, knee]', '[hip, "kn\\nee"]', 6, f'{LEG}, field joints',
                                    "the text 'kn\\nee'", f'a joint name: {NAME}'),
    'joint twice': ('[hip, knee]', '[hip,\n      hip]', 7, f'{LEG}, field joints',
                    'joint hip again', 'each joint once'),
    'joints are no list': ('[hip, knee]', 'hip', 6, f'{LEG}, field joints', "'hip'",
                           'a list of joint names'),
    'no joints': ('[hip, knee]', '[]', 6, f'{LEG}, field joints', '0 items',
                  'a list of joint names'),
    'two chains with one tip': (
        GOOD, GOOD + GOOD[GOOD.index('  leg:'):].replace('  leg:', '  arm:'), 26,
        'chain arm, field tip', 'foot, the tip of chain leg', 'a tip of its own'),
    # --- tip frames
    'no tip frames': (GOOD[GOOD.index('      dh'):GOOD.index('    versions')], '      {}\n', 8,
                      f'{LEG}, field tip_frames', 'none', 'at least one tip frame'),
    'frame id with a leading slash': ('root_link', '/root_link', 5, f'{LEG}, field root_frame',
                                      "'/root_link'", f'a frame id: {FRAME}'),
    'tip frame that is the root': ('foot_dh', 'root_link', 8,
                                   f'{LEG}, field tip_frames, dh, field frame', "'root_link'",
                                   'another frame id than the root frame'),
    'tip frame without name': ('{frame: foot_dh}', '{}', 8,
                               f'{LEG}, field tip_frames, dh, field frame', 'nothing',
                               'all of frame'),
    # --- versions
    'versions empty': (GOOD[GOOD.index('versions'):], 'versions: {}', 12,
                       f'{LEG}, field versions', 'none', 'at least one version'),
    'version twice': (GOOD, GOOD + '      v1: {}\n', 25, V1, 'a duplicate key', 'each key once'),
    'unknown version key': ('T_nIs:', 'link_7:', 24, V1, "unknown key 'link_7'", VERSION),
    'missing root transform': ('        T_Ro0:', '        T_nIs2:', 15, V1,
                               "unknown key 'T_nIs2' (did you mean 'T_nIs'?)", VERSION),
    'source of several lines': ('"somewhere"', '|\n          some\n          where', 14,
                                f'{V1}, field source', "the text 'some\\nwhere\\n'",
                                'text of one line'),
    # --- matrices
    'three rows': ('          - [0, 0, 0, 1]\n', '', 16, f'{V1}, field T_Ro0', '3 items',
                   '4 rows of 4 numbers'),
    'row of three': ('[0, -1, 0, -119.9]', '[0, -1, 0]', 18, f'{V1}, field T_Ro0, row 2',
                     '3 items', 'a row of 4 numbers'),
    'matrix entry is a word': ('[0, -1, 0, -119.9]', '[0, -1, o, -119.9]', 18,
                               f'{V1}, field T_Ro0, row 2, column 2', "'o'", 'a finite number'),
    'matrix that scales': ('[1, 0, 0, 5]', '[2, 0, 0, 5]', 16, f'{V1}, field T_Ro0',
                           'a matrix that is not a rigid transform', RIGID),
    'last row of a matrix': ('[1, 0, 0, 0], [0, 0, 0, 1]]', '[1, 0, 0, 0], [0, 0, 1, 1]]', 11,
                             f'{LEG}, field tip_frames, sole, field transform',
                             'a matrix that is not a rigid transform', RIGID),
    # --- rows
    'row too few': (GOOD[GOOD.index('          - {a: 30'):GOOD.index('          - {a: 1,')],
                    '', 21, f'{V1}, field links', '1 row with a joint', '2, one per joint'),
    'cell missing': ('d: 20, ', '', 21, f'{ROW_0}, field d', 'nothing', f'all of {DH}'),
    'unknown cell': ('offset: 0, type', 'theta: 0, type', 22, ROW_1, "unknown key 'theta'", LINK),
    'cell twice': ('{a: 30', '{a: 30, a: 31', 22, f'{ROW_1}, field a', 'a duplicate key',
                   'each key once'),
    'number in quotes': ('a: 10', 'a: "10"', 21, f'{ROW_0}, field a', "the text '10'", NUMBER_MM),
    'not a number': ('d: 20', 'd: .nan', 21, f'{ROW_0}, field d', "'.nan'", NUMBER_MM),
    'number beyond floats': ('d: 20', 'd: 1e999', 21, f'{ROW_0}, field d', "'1e999'", NUMBER_MM),
    'length beyond reason': ('a: 10', 'a: -1e300', 21, f'{ROW_0}, field a', "'-1e300'",
                             'a length up to 1e+09 m'),
    'sexagesimal': ('alpha: -90', 'alpha: 1:30', 21, f'{ROW_0}, field alpha', "'1:30'",
                    NUMBER_DEG),
    'expression': ('alpha: -90', 'alpha: pi/0', 21, f'{ROW_0}, field alpha', "'pi/0'",
                   NUMBER_DEG),
    'number with a unit': ('offset: 90', 'offset: 90 deg', 21, f'{ROW_0}, field offset',
                           "'90 deg'", NUMBER_DEG),
    'nothing': ('a: 10', 'a: ', 21, f'{ROW_0}, field a', 'nothing', NUMBER_MM),
    'range reversed': ('[-44, 132]', '[132, -44]', 21, f'{ROW_0}, field range',
                       "'132' above '-44'", 'lower at most upper'),
    'range is a number': ('[-44, 132]', '132', 21, f'{ROW_0}, field range', "'132'",
                          '[lower, upper]'),
    'bad joint type': ('prismatic', 'screw', 22, f'{ROW_1}, field type', "'screw'",
                       'revolute or prismatic or fixed'),
    'erratum of several lines': ('"odd"', '"odd\\neven"', 22, f'{ROW_1}, field erratum',
                                 "the text 'odd\\neven'", 'text of one line'),
    'fixed row with a range': ('{a: 1, d: 6.6', '{range: [0, 1], a: 1, d: 6.6', 23,
                               f'{V1}, row 2, field range', 'a list',
                               'nothing, since a fixed row has no joint'),
    'sign of two': ('offset: 90', 'offset: 90, sign: 2', 21, f'{ROW_0}, field sign', "'2'",
                    '1 or +1 or -1'),
    'robot range reversed': ('[-44, 132]', '[-44, 132], robot_range: [1, 0]', 21,
                             f'{ROW_0}, field robot_range', "'1' above '0'",
                             'lower at most upper'),
    'virtual link of old': ('        T_nIs', '        virtual_link: {a: 1}\n        T_nIs', 14, V1,
                            'key virtual_link', 'a last row of links instead, such as '
                            '{a: 0, d: 6.6, alpha: 90, offset: 0, type: fixed}'),
    'unknown convention': ('        T_nIs', '        convention: craig\n        T_nIs', 24,
                           f'{V1}, field convention', "'craig'", 'standard or modified'),
    # --- YAML that has no place here
    'alias': ('a: 30', 'a: &a 30, d: *a, x: 1', 22, FILE, 'alias *a', 'plain values'),
    'python tag': ('a: 30', 'a: !!python/object/apply:os.system [true]', 22, FILE,
                   'tag tag:yaml.org,2002:python/object/apply:os.system', 'plain values'),
    'second document': (GOOD, GOOD + '---\n' + GOOD, 25, FILE, 'a second document',
                        'one document'),
    'too deep': ('a: 30', 'a: ' + '[' * 20 + ']' * 20, 22, FILE, 'more than 16 nested levels',
                 'at most 16'),
    'very long value': ('a: 30', 'a: ' + 'x' * 200_000, 22, f'{ROW_1}, field a',
                        "'" + 'x' * 27 + '...' + 'x' * 28 + "'", NUMBER_MM),
    # --- bytes
    'zero byte': ('a: 30', 'a: 3\0', 22, FILE, 'character U+0000', 'printable text'),
}


@pytest.mark.usefixtures('_loader')
@pytest.mark.parametrize('kind', MISTAKES)
def test_a_mistake_is_one_line_with_place_found_and_allowed(kind: str, tmp_path: Path) -> None:
    old, new, line, where, found, allowed = MISTAKES[kind]
    assert old in GOOD
    file = write(tmp_path, GOOD.replace(old, new, 1))
    error = refusal(file)
    assert (error.line, error.where, error.found, error.allowed) == (line, where, found, allowed)
    assert str(error) == f'{file}:{line}: {where}: found {found}, allowed: {allowed}'


@pytest.mark.usefixtures('_loader')
def test_the_good_file_is_read(tmp_path: Path) -> None:
    for content in (GOOD, '\ufeff' + GOOD, GOOD.replace('\n', '\r\n'), '--- # one\n' + GOOD):
        chain = Catalog.load(write(tmp_path, content)).chain('leg', 'v1', 'sole')
        assert [link.d for link in chain.links] == [0.02, 0.04, 0.0066]
        assert chain.T_root_0[0, 3] == 0.005


@pytest.mark.usefixtures('_loader')
@pytest.mark.parametrize(('content', 'line', 'found'), [
    ('a: [1, 2\nb: 3}', 2, r'text that is not YAML \(.*'),
    ('a:\n\tb: 1\n', 2, r'text that is not YAML \(found .*cannot start any token.*'),
    ('a: b: c\n', 1, r'text that is not YAML \(mapping values are not allowed .*'),
    ('a: "b\n\n', 3, r'text that is not YAML \(.*end of stream.*'),
    ('a: 1\n b: 2\n', 2, r'text that is not YAML \(.*'),
    ('%YAML 9.9\n---\na: 1\n', 1, r'text that is not YAML \(.*incompatible.*'),
    ('a: "\\q"\n', 1, r'text that is not YAML \(.*escape character.*'),
])
def test_what_is_no_yaml_names_the_line(
        content: str, line: int, found: str, tmp_path: Path) -> None:
    error = refusal(write(tmp_path, content))
    assert (error.line, error.where, error.allowed) == (line, FILE, 'well-formed YAML')
    assert re.fullmatch(found, error.found)


@pytest.mark.usefixtures('_loader')
@pytest.mark.parametrize(('content', 'message'), [
    (b'', ': kinematics file: found nothing, allowed: units and chains'),
    (b'# only\n# comments\n', ': kinematics file: found nothing, allowed: units and chains'),
    (b'---\n', ':2: kinematics file: found nothing, allowed: a mapping with units, chains'),
    (b'left_leg', ":1: kinematics file: found 'left_leg', allowed: a mapping with units, chains"),
    (b'- 1\n', ':1: kinematics file: found a list, allowed: a mapping with units, chains'),
    (b'units:\n\n# caf\xe9', ':3: kinematics file: found byte 0xe9, allowed: UTF-8 text'),
    ('units: 1'.encode('utf-16'), ':1: kinematics file: found byte 0xff, allowed: UTF-8 text'),
    (b'\x7fELF\x02\x01', ':1: kinematics file: found character U+007F, allowed: printable text'),
    (b'#' * 1_000_001,
     ': kinematics file: found more than 1000000 bytes, allowed: at most 1000000 bytes'),
], ids=range(9))
def test_what_is_no_kinematics_file_says_so(
        content: bytes, message: str, tmp_path: Path) -> None:
    file = write(tmp_path, content)
    assert str(refusal(file)) == f'{file}{message}'


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    missing = tmp_path / 'missing.yaml'
    assert str(refusal(missing)) == (
        f'{missing}: kinematics file: found No such file or directory, '
        'allowed: a readable YAML file')
    assert 'found Is a directory' in str(refusal(tmp_path))
    assert 'found embedded null byte' in str(refusal(Path('a\0b')))
    assert str(refusal(Path('two\nlines'))).startswith(r"'two\nlines': kinematics file: found No")


def test_an_unreadable_file_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    """As seen by a user without the right to read; a test may run as root, who may read all."""
    def refuse(*_: object) -> None:
        raise PermissionError(13, 'Permission denied')

    monkeypatch.setattr('builtins.open', refuse)
    with pytest.raises(CatalogError) as error:
        Catalog.load('secret.yaml')
    monkeypatch.undo()
    assert str(error.value) == (
        'secret.yaml: kinematics file: found Permission denied, allowed: a readable YAML file')


def test_an_endless_file_is_not_read_to_its_end() -> None:
    zeros = Path('/dev/zero')
    if not zeros.exists():
        pytest.skip('there is no /dev/zero here')
    assert 'more than 1000000 bytes' in str(refusal(zeros))


@settings(max_examples=300)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(data: st.DataObject) -> None:
    """Cut pieces out, put others in: nothing but a catalog or one line comes of it."""
    content = GOOD
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(start, min(start + 40, len(content))))
        piece = data.draw(st.one_of(
            st.text(max_size=5),
            st.sampled_from(['&a ', '*a', '!!t ', '? ', ': ', '- ', '{', ']', '"', '|\n', '\n',
                             '<<: ', '1e309', '---\n', '\t', ' ' * 9, 'a: '])))
        content = content[:start] + piece + content[end:]
    with tempfile.NamedTemporaryFile(suffix='.yaml') as stream:
        stream.write(content.encode('utf-8', 'surrogatepass'))
        stream.flush()
        try:
            catalog = Catalog.load(stream.name)
        except CatalogError as error:
            assert str(error).startswith(stream.name)
            assert str(error).isprintable() and len(str(error)) < 800
        else:
            assert catalog.chains
