"""Each kind of mistake in a kinematics file ends in one line: where, what, and what instead."""

from pathlib import Path
import tempfile

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.errors import CatalogError, InputFileError
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
DH = 'a, d, alpha'
ROW = f'{DH}, offset, range, robot_range, type, gain, joint, erratum'
TOP = 'units, chains, default_version'
CHAIN = 'tip, root_frame, joints, tip_frames, versions, root_axes, default_version'
NUMBER_MM, NUMBER_DEG = 'a finite number (mm)', 'a finite number (deg, or as in pi/2)'
RIGID = 'a rotation (to four decimals at least), a translation and the last row 0 0 0 1'
NAME = 'up to 300 printable characters'
FRAME = f'{NAME}, not beginning with /'
WORD = 'a letter, then up to 63 letters, digits and _'
FILE, LEG, V1 = 'kinematics file', 'chain leg', 'chain leg, version v1'
VERSION = (
    'links, T_Ro0, T_nIs, convention, source, root_frame, joints, tip_frames, root_axes'
)
ROW_0, ROW_1 = f'{V1}, row 0', f'{V1}, row 1'


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
    'unknown length unit': (
        'length: mm',
        'length: inch',
        1,
        f'{FILE}, field units, field length',
        "'inch'",
        'mm or m',
    ),
    'no unit': (
        '{length: mm, angle: deg}',
        '{length: mm}',
        1,
        f'{FILE}, field units, field angle',
        'nothing',
        'all of length, angle',
    ),
    'units are no mapping': (
        '{length: mm, angle: deg}',
        'mm',
        1,
        f'{FILE}, field units',
        "'mm'",
        'a mapping with length, angle',
    ),
    # --- structure
    'unknown top key': (
        'units:',
        'unit:',
        1,
        FILE,
        "unknown key 'unit' (did you mean 'units'?)",
        TOP,
    ),
    'no chains': (
        GOOD[GOOD.index('chains') :],
        '',
        1,
        f'{FILE}, field chains',
        'nothing',
        'all of units, chains',
    ),
    'empty chains': (
        GOOD[GOOD.index('chains') :],
        'chains: {}',
        2,
        f'{FILE}, field chains',
        'none',
        'at least one chain',
    ),
    'chains is a list': (
        GOOD[GOOD.index('chains') :],
        'chains: [leg]',
        2,
        f'{FILE}, field chains',
        'a list',
        'chains by name',
    ),
    'chain twice': (
        GOOD,
        GOOD + '  leg: {}\n',
        25,
        LEG,
        'a duplicate key',
        'each key once',
    ),
    'unknown chain key': ('root_frame:', 'root:', 5, LEG, "unknown key 'root'", CHAIN),
    'key twice': (
        'tip: foot',
        'tip: foot\n    tip: foot',
        5,
        f'{LEG}, field tip',
        'a duplicate key',
        'each key once',
    ),
    # --- names
    'tip is no word': (
        'tip: foot',
        'tip: left foot',
        4,
        f'{LEG}, field tip',
        "'left foot'",
        f'a name: {WORD}',
    ),
    'joint name of several lines': (
        '[hip, knee]',
        '[hip, "kn\\nee"]',
        6,
        f'{LEG}, field joints',
        "the text 'kn\\nee'",
        f'a joint name: {NAME}',
    ),
    'joint twice': (
        '[hip, knee]',
        '[hip,\n      hip]',
        7,
        f'{LEG}, field joints',
        'joint hip again',
        'each joint once',
    ),
    'joints are no list': (
        '[hip, knee]',
        'hip',
        6,
        f'{LEG}, field joints',
        "'hip'",
        'a list of joint names',
    ),
    'no joints': (
        '[hip, knee]',
        '[]',
        6,
        f'{LEG}, field joints',
        'an empty list',
        'a list of joint names, at least one',
    ),
    'two chains with one tip': (
        GOOD,
        GOOD + GOOD[GOOD.index('  leg:') :].replace('  leg:', '  arm:'),
        26,
        'chain arm, field tip',
        'foot, the tip of chain leg',
        'another tip for each chain',
    ),
    # --- tip frames
    'no tip frames': (
        GOOD[GOOD.index('      dh') : GOOD.index('    versions')],
        '      {}\n',
        8,
        f'{LEG}, field tip_frames',
        'none',
        'at least one tip frame',
    ),
    'frame id with a leading slash': (
        'root_link',
        '/root_link',
        5,
        f'{LEG}, field root_frame',
        "'/root_link'",
        f'a frame id: {FRAME}',
    ),
    'tip frame that is the root': (
        'foot_dh',
        'root_link',
        8,
        f'{LEG}, field tip_frames, dh, field frame',
        "'root_link'",
        'another frame id than the root frame',
    ),
    'tip frame without name': (
        '{frame: foot_dh}',
        '{}',
        8,
        f'{LEG}, field tip_frames, dh, field frame',
        'nothing',
        'all of frame',
    ),
    # --- versions
    'versions empty': (
        GOOD[GOOD.index('versions') :],
        'versions: {}',
        12,
        f'{LEG}, field versions',
        'none',
        'at least one version',
    ),
    'version twice': (
        GOOD,
        GOOD + '      v1: {}\n',
        25,
        V1,
        'a duplicate key',
        'each key once',
    ),
    'unknown version key': (
        'T_nIs:',
        'T_nls:',
        24,
        V1,
        "unknown key 'T_nls' (did you mean 'T_nIs'?)",
        VERSION,
    ),
    'default version that no chain has': (
        GOOD,
        'default_version: v2\n' + GOOD,
        1,
        f'{FILE}, field default_version',
        "'v2'",
        'a version of the file: v1',
    ),
    'default version that the chain lacks': (
        '    versions:',
        '    default_version: v2\n    versions:',
        12,
        f'{LEG}, field default_version',
        "'v2'",
        'v1',
    ),
    'root axes of a left hand': (
        '    joints',
        '    root_axes: [forward, right, up]\n    joints',
        6,
        f'{LEG}, field root_axes',
        'forward, right, up',
        'directions of x, y, z that make a right-handed frame',
    ),
    'root axis of no direction': (
        '    joints',
        '    root_axes: [north, right, up]\n    joints',
        6,
        f'{LEG}, field root_axes',
        "'north'",
        'forward or backward or left or right or up or down',
    ),
    'outline of two corners': (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2], [3, 4]]\n',
        11,
        f'{LEG}, field tip_frames, sole, field outline',
        '2',
        'at least three corners',
    ),
    'outline in space': (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2, 3]]\n',
        11,
        f'{LEG}, field tip_frames, sole, field outline',
        '3 items',
        '[x, y]',
    ),
    'source of several lines': (
        '"somewhere"',
        '|\n          some\n          where',
        14,
        f'{V1}, field source',
        "the text 'some\\nwhere\\n'",
        'text of one line',
    ),
    # --- matrices
    'three rows': (
        '          - [0, 0, 0, 1]\n',
        '',
        16,
        f'{V1}, field T_Ro0',
        '3 items',
        '4 rows of 4 numbers',
    ),
    'row of three': (
        '[0, -1, 0, -119.9]',
        '[0, -1, 0]',
        18,
        f'{V1}, field T_Ro0, row 2',
        '3 items',
        'a row of 4 numbers',
    ),
    'matrix entry is a word': (
        '[0, -1, 0, -119.9]',
        '[0, -1, o, -119.9]',
        18,
        f'{V1}, field T_Ro0, row 2, column 2',
        "'o'",
        'a finite number',
    ),
    'matrix that scales': (
        '[1, 0, 0, 5]',
        '[2, 0, 0, 5]',
        16,
        f'{V1}, field T_Ro0',
        'a matrix that is not a rigid transform',
        RIGID,
    ),
    'last row of a matrix': (
        '[1, 0, 0, 0], [0, 0, 0, 1]]',
        '[1, 0, 0, 0], [0, 0, 1, 1]]',
        11,
        f'{LEG}, field tip_frames, sole, field transform',
        'a matrix that is not a rigid transform',
        RIGID,
    ),
    # --- rows
    'row too few': (
        GOOD[GOOD.index('          - {a: 30') : GOOD.index('          - {a: 1,')],
        '',
        21,
        f'{V1}, field links',
        '1 row with a joint',
        '2, one per joint that no row names',
    ),
    'no rows': (
        GOOD[GOOD.index('        links:') : GOOD.index('        T_nIs')],
        '        links: []\n',
        20,
        f'{V1}, field links',
        'an empty list',
        'a list of rows, at least one',
    ),
    'cell missing': ('d: 20, ', '', 21, f'{ROW_0}, field d', 'nothing', f'all of {DH}'),
    'unknown cell': (
        'offset: 0, type',
        'ofset: 0, type',
        22,
        ROW_1,
        "unknown key 'ofset' (did you mean 'offset'?)",
        ROW,
    ),
    'theta': (
        'offset: 0, type',
        'theta: 0, type',
        22,
        ROW_1,
        'key theta',
        'offset instead',
    ),
    'sign of old': (
        'offset: 90',
        'offset: 90, sign: -1',
        21,
        ROW_0,
        'key sign',
        'gain instead',
    ),
    'gain that moves nothing': (
        'offset: 90',
        'offset: 90, gain: 0',
        21,
        f'{ROW_0}, field gain',
        "'0'",
        'a number other than 0',
    ),
    'unknown joint of a row': (
        'offset: 90',
        'offset: 90, joint: kne',
        21,
        f'{ROW_0}, field joint',
        "'kne'",
        'hip or knee',
    ),
    'joint of a fixed row': (
        '{a: 1, d: 6.6',
        '{joint: hip, a: 1, d: 6.6',
        23,
        f'{V1}, row 2, field joint',
        "'hip'",
        'nothing, since a fixed row has no joint',
    ),
    'range on a row that follows': (
        '{a: 1, d: 6.6, alpha: 90, offset: 0, type: fixed}',
        '{a: 1, d: 6, alpha: 90, joint: hip}\n'
        '          - {a: 1, d: 6, alpha: 90, joint: hip, range: [0, 1]}',
        24,
        f'{V1}, row 3, field range',
        'a list',
        'nothing: the range of joint hip stands on the first row that it moves',
    ),
    'cell twice': (
        '{a: 30',
        '{a: 30, a: 31',
        22,
        f'{ROW_1}, field a',
        'a duplicate key',
        'each key once',
    ),
    'number in quotes': (
        'a: 10',
        'a: "10"',
        21,
        f'{ROW_0}, field a',
        "the text '10'",
        NUMBER_MM,
    ),
    'not a number': ('d: 20', 'd: .nan', 21, f'{ROW_0}, field d', "'.nan'", NUMBER_MM),
    'number beyond floats': (
        'd: 20',
        'd: 1e999',
        21,
        f'{ROW_0}, field d',
        "'1e999'",
        NUMBER_MM,
    ),
    'length beyond reason': (
        'a: 10',
        'a: -1e300',
        21,
        f'{ROW_0}, field a',
        "'-1e300'",
        'a length up to 1e+09 m',
    ),
    'sexagesimal': (
        'alpha: -90',
        'alpha: 1:30',
        21,
        f'{ROW_0}, field alpha',
        "'1:30'",
        NUMBER_DEG,
    ),
    'expression': (
        'alpha: -90',
        'alpha: pi/0',
        21,
        f'{ROW_0}, field alpha',
        "'pi/0'",
        NUMBER_DEG,
    ),
    'number with a unit': (
        'offset: 90',
        'offset: 90 deg',
        21,
        f'{ROW_0}, field offset',
        "'90 deg'",
        NUMBER_DEG,
    ),
    'nothing': ('a: 10', 'a: ', 21, f'{ROW_0}, field a', 'nothing', NUMBER_MM),
    'range reversed': (
        '[-44, 132]',
        '[132, -44]',
        21,
        f'{ROW_0}, field range',
        "'132' above '-44'",
        'lower at most upper',
    ),
    'range is a number': (
        '[-44, 132]',
        '132',
        21,
        f'{ROW_0}, field range',
        "'132'",
        '[lower, upper]',
    ),
    'bad joint type': (
        'prismatic',
        'screw',
        22,
        f'{ROW_1}, field type',
        "'screw'",
        'revolute or prismatic or fixed',
    ),
    'erratum of several lines': (
        '"odd"',
        '"odd\\neven"',
        22,
        f'{ROW_1}, field erratum',
        "the text 'odd\\neven'",
        'text of one line',
    ),
    'fixed row with a range': (
        '{a: 1, d: 6.6',
        '{range: [0, 1], a: 1, d: 6.6',
        23,
        f'{V1}, row 2, field range',
        'a list',
        'nothing, since a fixed row has no joint',
    ),
    'robot range reversed': (
        '[-44, 132]',
        '[-44, 132], robot_range: [1, 0]',
        21,
        f'{ROW_0}, field robot_range',
        "'1' above '0'",
        'lower at most upper',
    ),
    'virtual link of old': (
        '        T_nIs',
        '        virtual_link: {a: 1}\n        T_nIs',
        14,
        V1,
        'key virtual_link',
        'a last row of links instead, such as '
        '{a: 0, d: 6.6, alpha: 90, offset: 0, type: fixed}',
    ),
    'unknown convention': (
        '        T_nIs',
        '        convention: craig\n        T_nIs',
        24,
        f'{V1}, field convention',
        "'craig'",
        'standard or modified',
    ),
    # --- values
    'python tag': (
        'a: 30',
        'a: !!python/object/apply:os.system [true]',
        22,
        f'{ROW_1}, field a',
        'a list',
        NUMBER_MM,
    ),
    'list in itself': (
        'a: 30',
        'a: &a [*a]',
        22,
        f'{ROW_1}, field a',
        'a list',
        NUMBER_MM,
    ),
    'very long value': (
        'a: 30',
        'a: ' + 'x' * 200_000,
        22,
        f'{ROW_1}, field a',
        "'" + 'x' * 27 + '...' + 'x' * 28 + "'",
        NUMBER_MM,
    ),
}


@pytest.mark.parametrize('kind', MISTAKES)
def test_a_mistake_is_one_line_with_place_found_and_allowed(
    kind: str, tmp_path: Path
) -> None:
    old, new, line, where, found, allowed = MISTAKES[kind]
    assert old in GOOD
    file = write(tmp_path, GOOD.replace(old, new, 1))
    error = refusal(file)
    assert (error.line, error.where, error.found, error.allowed) == (
        line,
        where,
        found,
        allowed,
    )
    assert str(error) == f'{file}:{line}: {where}: found {found}, allowed: {allowed}'


def test_the_good_file_is_read(tmp_path: Path) -> None:
    for content in (
        GOOD,
        '\ufeff' + GOOD,
        GOOD.replace('\n', '\r\n'),
        '--- # one\n' + GOOD,
    ):
        chain = Catalog.load(write(tmp_path, content)).chain('leg', 'v1', 'sole')
        assert [link.d for link in chain.links] == [0.02, 0.04, 0.0066]
        assert chain.T_root_0[0, 3] == 0.005


@pytest.mark.parametrize(
    'kind', ['no unit', 'chain twice', 'not a number', 'python tag', 'list in itself']
)
def test_a_mistake_reads_the_same_where_pyyaml_has_no_libyaml(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(yaml_fields, 'Loader', yaml.BaseLoader)
    test_a_mistake_is_one_line_with_place_found_and_allowed(kind, tmp_path)


@pytest.mark.parametrize(
    ('content', 'place', 'found', 'allowed'),
    [
        (b'', '', 'nothing', 'units and chains'),
        (b'---\n', ':2', 'nothing', f'a mapping with {TOP}'),
        (b'left_leg', ':1', "'left_leg'", f'a mapping with {TOP}'),
        (b'- 1\n', ':1', 'a list', f'a mapping with {TOP}'),
        (
            b'units:\n\n# caf\xe9',
            ':3',
            'a byte or character that is not printable UTF-8 text',
            '',
        ),
        (b'a: 3\0', ':1', 'a byte or character that is not printable UTF-8 text', ''),
        (
            b'a:\n\tb: 1\n',
            ':2',
            'text that is not YAML (found character that cannot start',
            '',
        ),
        (
            b'a: 1\n---\na: 2\n',
            ':2',
            'text that is not YAML (but found another document)',
            '',
        ),
        (b'#' * 1_000_001, '', 'more than 1000000 bytes', 'at most 1000000 bytes'),
    ],
    ids=range(9),
)
def test_what_is_no_kinematics_file_says_so(
    content: bytes, place: str, found: str, allowed: str, tmp_path: Path
) -> None:
    file = write(tmp_path, content)
    error = str(refusal(file))
    assert error.startswith(f'{file}{place}: kinematics file: found {found}')
    assert error.endswith(f', allowed: {allowed}') or not allowed


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    missing = tmp_path / 'missing.yaml'
    assert str(refusal(missing)) == f'cannot read {missing}: no such file or directory'
    assert str(refusal(tmp_path)) == f'cannot read {tmp_path}: is a directory'
    assert str(refusal(Path('a\0b'))).endswith('embedded null byte')
    assert str(refusal(Path('two\nlines'))).startswith(
        r"cannot read 'two\nlines': no such file"
    )


def test_an_endless_file_is_not_read_to_its_end() -> None:
    zeros = Path('/dev/zero')
    if not zeros.exists():
        pytest.skip('there is no /dev/zero here')
    assert 'more than 1000000 bytes' in str(refusal(zeros))


def test_a_small_file_that_says_very_much_by_aliases_is_refused(tmp_path: Path) -> None:
    head = GOOD[: GOOD.index('      v1:')].replace('[hip, knee]', '[hip]')
    rows = '{a: 1, d: 1, alpha: 1}, ' + '{a: 1, d: 1, alpha: 1, type: fixed}, ' * 999
    copies = ''.join(f'      v{i}: {{links: *rows}}\n' for i in range(10))
    error = refusal(
        write(tmp_path, f'{head}      v: {{links: &rows [{rows}]}}\n{copies}')
    )
    assert (error.found, error.allowed) == ('too many rows', 'at most 10000 in a file')


@settings(max_examples=100)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(data: st.DataObject) -> None:
    """Cut pieces out, put others in: nothing but a catalog or one line comes of it."""
    content = GOOD
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(start, min(start + 40, len(content))))
        piece = data.draw(
            st.one_of(
                st.text(max_size=5),
                st.sampled_from(
                    [
                        '&a ',
                        '*a',
                        '!!t ',
                        '? ',
                        ': ',
                        '- ',
                        '{',
                        ']',
                        '"',
                        '|\n',
                        '\n',
                        '<<: ',
                        '1e309',
                        '---\n',
                        '\t',
                        ' ' * 9,
                        'a: ',
                    ]
                ),
            )
        )
        content = content[:start] + piece + content[end:]
    with tempfile.NamedTemporaryFile(suffix='.yaml') as stream:
        stream.write(content.encode('utf-8', 'surrogatepass'))
        stream.flush()
        try:
            catalog = Catalog.load(stream.name)
        except InputFileError as error:  # of a URDF, if it begins as XML
            assert str(error).startswith(stream.name)
            assert str(error).isprintable() and len(str(error)) < 800
        else:
            assert catalog.chains
