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
VERSION = (
    'links, T_Ro0, T_nIs, convention, source, root_frame, joints, tip_frames, root_axes'
)


def refusal(path):
    with pytest.raises(CatalogError) as error:
        Catalog.load(path)
    text = str(error.value)
    assert text.isprintable() and len(text) < 600
    return error.value


LONG = 200_000 * 'x'

# What to replace in the good file, by what; place, found and allowed of the error.
MISTAKES = [
    (
        'length: mm',
        'length: inch',
        '1: kinematics file, field units, field length',
        "'inch'",
        'mm or m',
    ),
    (
        '{length: mm, angle: deg}',
        '{length: mm}',
        '1: kinematics file, field units, field angle',
        'nothing',
        'all of length, angle',
    ),
    (
        '{length: mm, angle: deg}',
        'mm',
        '1: kinematics file, field units',
        "'mm'",
        'a mapping with length, angle',
    ),
    (
        'units:',
        'unit:',
        '1: kinematics file',
        "unknown key 'unit' (did you mean 'units'?)",
        TOP,
    ),
    (
        GOOD[GOOD.index('chains') :],
        '',
        '1: kinematics file, field chains',
        'nothing',
        'all of units, chains',
    ),
    (
        GOOD[GOOD.index('chains') :],
        'chains: {}',
        '2: kinematics file, field chains',
        'none',
        'at least one chain',
    ),
    (
        GOOD[GOOD.index('chains') :],
        'chains: [leg]',
        '2: kinematics file, field chains',
        'a list',
        'chains by name',
    ),
    (
        GOOD,
        GOOD + '  leg: {}\n',
        '25: chain leg',
        'a duplicate key',
        'each key once',
    ),
    (
        'root_frame:',
        'root:',
        '5: chain leg',
        "unknown key 'root'",
        CHAIN,
    ),
    (
        'tip: foot',
        'tip: foot\n    tip: foot',
        '5: chain leg, field tip',
        'a duplicate key',
        'each key once',
    ),
    (
        'tip: foot',
        'tip: left foot',
        '4: chain leg, field tip',
        "'left foot'",
        f'a name: {WORD}',
    ),
    (
        '[hip, knee]',
        '[hip, "kn\\nee"]',
        '6: chain leg, field joints',
        "the text 'kn\\nee'",
        f'a joint name: {NAME}',
    ),
    (
        '[hip, knee]',
        '[hip,\n      hip]',
        '7: chain leg, field joints',
        'joint hip again',
        'each joint once',
    ),
    (
        '[hip, knee]',
        'hip',
        '6: chain leg, field joints',
        "'hip'",
        'a list of joint names',
    ),
    (
        '[hip, knee]',
        '[]',
        '6: chain leg, field joints',
        'an empty list',
        'a list of joint names, at least one',
    ),
    (
        GOOD,
        GOOD + GOOD[GOOD.index('  leg:') :].replace('  leg:', '  arm:'),
        '26: chain arm, field tip',
        'foot, the tip of chain leg',
        'another tip for each chain',
    ),
    (
        GOOD[GOOD.index('      dh') : GOOD.index('    versions')],
        '      {}\n',
        '8: chain leg, field tip_frames',
        'none',
        'at least one tip frame',
    ),
    (
        'root_link',
        '/root_link',
        '5: chain leg, field root_frame',
        "'/root_link'",
        f'a frame id: {FRAME}',
    ),
    (
        'foot_dh',
        'root_link',
        '8: chain leg, field tip_frames, dh, field frame',
        "'root_link'",
        'another frame id than the root frame',
    ),
    (
        '{frame: foot_dh}',
        '{}',
        '8: chain leg, field tip_frames, dh, field frame',
        'nothing',
        'all of frame',
    ),
    (
        GOOD[GOOD.index('versions') :],
        'versions: {}',
        '12: chain leg, field versions',
        'none',
        'at least one version',
    ),
    (
        GOOD,
        GOOD + '      v1: {}\n',
        '25: chain leg, version v1',
        'a duplicate key',
        'each key once',
    ),
    (
        'T_nIs:',
        'T_nls:',
        '24: chain leg, version v1',
        "unknown key 'T_nls' (did you mean 'T_nIs'?)",
        VERSION,
    ),
    (
        GOOD,
        'default_version: v2\n' + GOOD,
        '1: kinematics file, field default_version',
        "'v2'",
        'a version of the file: v1',
    ),
    (
        '    versions:',
        '    default_version: v2\n    versions:',
        '12: chain leg, field default_version',
        "'v2'",
        'v1',
    ),
    (
        '    joints',
        '    root_axes: [forward, right, up]\n    joints',
        '6: chain leg, field root_axes',
        'forward, right, up',
        'directions of x, y, z that make a right-handed frame',
    ),
    (
        '    joints',
        '    root_axes: [north, right, up]\n    joints',
        '6: chain leg, field root_axes',
        "'north'",
        'forward or backward or left or right or up or down',
    ),
    (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2], [3, 4]]\n',
        '11: chain leg, field tip_frames, sole, field outline',
        '2',
        'at least three corners',
    ),
    (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2, 3]]\n',
        '11: chain leg, field tip_frames, sole, field outline',
        '3 items',
        '[x, y]',
    ),
    (
        '"somewhere"',
        '|\n          some\n          where',
        '14: chain leg, version v1, field source',
        "the text 'some\\nwhere\\n'",
        'text of one line',
    ),
    (
        '          - [0, 0, 0, 1]\n',
        '',
        '16: chain leg, version v1, field T_Ro0',
        '3 items',
        '4 rows of 4 numbers',
    ),
    (
        '[0, -1, 0, -119.9]',
        '[0, -1, 0]',
        '18: chain leg, version v1, field T_Ro0, row 2',
        '3 items',
        'a row of 4 numbers',
    ),
    (
        '[0, -1, 0, -119.9]',
        '[0, -1, o, -119.9]',
        '18: chain leg, version v1, field T_Ro0, row 2, column 2',
        "'o'",
        'a finite number',
    ),
    (
        '[1, 0, 0, 5]',
        '[2, 0, 0, 5]',
        '16: chain leg, version v1, field T_Ro0',
        'a matrix that is not a rigid transform',
        RIGID,
    ),
    (
        '[1, 0, 0, 0], [0, 0, 0, 1]]',
        '[1, 0, 0, 0], [0, 0, 1, 1]]',
        '11: chain leg, field tip_frames, sole, field transform',
        'a matrix that is not a rigid transform',
        RIGID,
    ),
    (
        GOOD[GOOD.index('          - {a: 30') : GOOD.index('          - {a: 1,')],
        '',
        '21: chain leg, version v1, field links',
        '1 row with a joint',
        '2, one per joint that no row names',
    ),
    (
        GOOD[GOOD.index('        links:') : GOOD.index('        T_nIs')],
        '        links: []\n',
        '20: chain leg, version v1, field links',
        'an empty list',
        'a list of rows, at least one',
    ),
    (
        'd: 20, ',
        '',
        '21: chain leg, version v1, row 0, field d',
        'nothing',
        f'all of {DH}',
    ),
    (
        'offset: 0, type',
        'ofset: 0, type',
        '22: chain leg, version v1, row 1',
        "unknown key 'ofset' (did you mean 'offset'?)",
        ROW,
    ),
    (
        'offset: 0, type',
        'theta: 0, type',
        '22: chain leg, version v1, row 1',
        'key theta',
        'offset instead',
    ),
    (
        'offset: 90',
        'offset: 90, sign: -1',
        '21: chain leg, version v1, row 0',
        'key sign',
        'gain instead',
    ),
    (
        'offset: 90',
        'offset: 90, gain: 0',
        '21: chain leg, version v1, row 0, field gain',
        "'0'",
        'a number other than 0',
    ),
    (
        'offset: 90',
        'offset: 90, joint: kne',
        '21: chain leg, version v1, row 0, field joint',
        "'kne'",
        'hip or knee',
    ),
    (
        '{a: 1, d: 6.6',
        '{joint: hip, a: 1, d: 6.6',
        '23: chain leg, version v1, row 2, field joint',
        "'hip'",
        'nothing, since a fixed row has no joint',
    ),
    (
        '{a: 1, d: 6.6, alpha: 90, offset: 0, type: fixed}',
        '{a: 1, d: 6, alpha: 90, joint: hip}\n'
        '          - {a: 1, d: 6, alpha: 90, joint: hip, range: [0, 1]}',
        '24: chain leg, version v1, row 3, field range',
        'a list',
        'nothing: the range of joint hip stands on the first row that it moves',
    ),
    (
        '{a: 30',
        '{a: 30, a: 31',
        '22: chain leg, version v1, row 1, field a',
        'a duplicate key',
        'each key once',
    ),
    (
        'a: 10',
        'a: "10"',
        '21: chain leg, version v1, row 0, field a',
        "the text '10'",
        NUMBER_MM,
    ),
    (
        'd: 20',
        'd: .nan',
        '21: chain leg, version v1, row 0, field d',
        "'.nan'",
        NUMBER_MM,
    ),
    (
        'd: 20',
        'd: 1e999',
        '21: chain leg, version v1, row 0, field d',
        "'1e999'",
        NUMBER_MM,
    ),
    (
        'a: 10',
        'a: -1e300',
        '21: chain leg, version v1, row 0, field a',
        "'-1e300'",
        'a length up to 1e+09 m',
    ),
    (
        'alpha: -90',
        'alpha: 1:30',
        '21: chain leg, version v1, row 0, field alpha',
        "'1:30'",
        NUMBER_DEG,
    ),
    (
        'alpha: -90',
        'alpha: pi/0',
        '21: chain leg, version v1, row 0, field alpha',
        "'pi/0'",
        NUMBER_DEG,
    ),
    (
        'offset: 90',
        'offset: 90 deg',
        '21: chain leg, version v1, row 0, field offset',
        "'90 deg'",
        NUMBER_DEG,
    ),
    (
        'a: 10',
        'a: ',
        '21: chain leg, version v1, row 0, field a',
        'nothing',
        NUMBER_MM,
    ),
    (
        '[-44, 132]',
        '[132, -44]',
        '21: chain leg, version v1, row 0, field range',
        "'132' above '-44'",
        'lower at most upper',
    ),
    (
        '[-44, 132]',
        '132',
        '21: chain leg, version v1, row 0, field range',
        "'132'",
        '[lower, upper]',
    ),
    (
        'prismatic',
        'screw',
        '22: chain leg, version v1, row 1, field type',
        "'screw'",
        'revolute or prismatic or fixed',
    ),
    (
        '"odd"',
        '"odd\\neven"',
        '22: chain leg, version v1, row 1, field erratum',
        "the text 'odd\\neven'",
        'text of one line',
    ),
    (
        '{a: 1, d: 6.6',
        '{range: [0, 1], a: 1, d: 6.6',
        '23: chain leg, version v1, row 2, field range',
        'a list',
        'nothing, since a fixed row has no joint',
    ),
    (
        '[-44, 132]',
        '[-44, 132], robot_range: [1, 0]',
        '21: chain leg, version v1, row 0, field robot_range',
        "'1' above '0'",
        'lower at most upper',
    ),
    (
        '        T_nIs',
        '        virtual_link: {a: 1}\n        T_nIs',
        '24: chain leg, version v1',
        'key virtual_link',
        'a last row such as {a: 0, d: 6.6, alpha: 90, type: fixed} instead',
    ),
    (
        '        T_nIs',
        '        convention: craig\n        T_nIs',
        '24: chain leg, version v1, field convention',
        "'craig'",
        'standard or modified',
    ),
    (
        'a: 30',
        'a: !!python/object/apply:os.system [true]',
        '22: chain leg, version v1, row 1, field a',
        'a list',
        NUMBER_MM,
    ),
    (
        'a: 30',
        'a: &a [*a]',
        '22: chain leg, version v1, row 1, field a',
        'a list',
        NUMBER_MM,
    ),
    (
        'a: 30',
        f'a: {LONG}',
        '22: chain leg, version v1, row 1, field a',
        f"'{LONG[:27]}...{LONG[:28]}'",
        NUMBER_MM,
    ),
]


@pytest.mark.parametrize(
    'mistake', MISTAKES, ids=[f'{row[2]} {row[3][:30]}' for row in MISTAKES]
)
def test_a_mistake_is_one_line_with_place_found_and_allowed(mistake, written):
    old, new, place, found, allowed = mistake
    assert old in GOOD
    file = written(GOOD.replace(old, new, 1))
    error = refusal(file)
    assert str(error) == f'{file}:{place}: found {found}, allowed: {allowed}'
    assert f'{error.line}: {error.where}' == place
    assert (error.found, error.allowed) == (found, allowed)


def test_the_good_file_is_read(written):
    for content in (
        GOOD,
        '\ufeff' + GOOD,
        GOOD.replace('\n', '\r\n'),
        '--- # one\n' + GOOD,
    ):
        chain = Catalog.load(written(content)).chain('leg', 'v1', 'sole')
        assert [link.d for link in chain.links] == [0.02, 0.04, 0.0066]
        assert chain.T_root_0[0, 3] == 0.005


@pytest.mark.parametrize('mistake', [*MISTAKES[1:8:3], *MISTAKES[-3:-1]])
def test_a_mistake_reads_the_same_where_pyyaml_has_no_libyaml(
    mistake, written, monkeypatch
):
    monkeypatch.setattr(yaml_fields, 'Loader', yaml.BaseLoader)
    test_a_mistake_is_one_line_with_place_found_and_allowed(mistake, written)


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
def test_what_is_no_kinematics_file_says_so(content, place, found, allowed, written):
    file = written(content)
    error = str(refusal(file))
    assert error.startswith(f'{file}{place}: kinematics file: found {found}')
    assert error.endswith(f', allowed: {allowed}') or not allowed


def test_a_file_that_cannot_be_read_says_why(tmp_path):
    missing = tmp_path / 'missing.yaml'
    assert str(refusal(missing)) == f'cannot read {missing}: no such file or directory'
    assert str(refusal(tmp_path)) == f'cannot read {tmp_path}: is a directory'
    assert str(refusal(0)).startswith('cannot read 0: ')
    assert str(refusal(Path('a\0b'))).endswith('embedded null byte')
    assert str(refusal(Path('two\nlines'))).startswith(
        r"cannot read 'two\nlines': no such file"
    )


def test_an_endless_file_is_not_read_to_its_end():
    zeros = Path('/dev/zero')
    if not zeros.exists():
        pytest.skip('there is no /dev/zero here')
    assert 'more than 1000000 bytes' in str(refusal(zeros))


def test_a_small_file_that_says_very_much_by_aliases_is_refused(written):
    head = GOOD[: GOOD.index('      v1:')].replace('[hip, knee]', '[hip]')
    rows = '{a: 1, d: 1, alpha: 1}, ' + '{a: 1, d: 1, alpha: 1, type: fixed}, ' * 999
    copies = ''.join(f'      v{i}: {{links: *rows}}\n' for i in range(10))
    error = refusal(written(f'{head}      v: {{links: &rows [{rows}]}}\n{copies}'))
    assert (error.found, error.allowed) == ('too many rows', 'at most 10000 in a file')


@settings(max_examples=100)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(data):
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
