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


# What to replace in the good file, by what, and what is said then.
MISTAKES = [
    (
        'length: mm',
        'length: inch',
        f"1: {FILE}, field units, field length: found 'inch', allowed: mm or m",
    ),
    (
        '{length: mm, angle: deg}',
        '{length: mm}',
        f'1: {FILE}, field units, field angle: found nothing, allowed: all of length, angle',
    ),
    (
        '{length: mm, angle: deg}',
        'mm',
        f"1: {FILE}, field units: found 'mm', allowed: a mapping with length, angle",
    ),
    (
        'units:',
        'unit:',
        f"1: {FILE}: found unknown key 'unit' (did you mean 'units'?), allowed: {TOP}",
    ),
    (
        GOOD[GOOD.index('chains') :],
        '',
        f'1: {FILE}, field chains: found nothing, allowed: all of units, chains',
    ),
    (
        GOOD[GOOD.index('chains') :],
        'chains: {}',
        f'2: {FILE}, field chains: found none, allowed: at least one chain',
    ),
    (
        GOOD[GOOD.index('chains') :],
        'chains: [leg]',
        f'2: {FILE}, field chains: found a list, allowed: chains by name',
    ),
    (
        GOOD,
        GOOD + '  leg: {}\n',
        f'25: {LEG}: found a duplicate key, allowed: each key once',
    ),
    ('root_frame:', 'root:', f"5: {LEG}: found unknown key 'root', allowed: {CHAIN}"),
    (
        'tip: foot',
        'tip: foot\n    tip: foot',
        f'5: {LEG}, field tip: found a duplicate key, allowed: each key once',
    ),
    (
        'tip: foot',
        'tip: left foot',
        f"4: {LEG}, field tip: found 'left foot', allowed: a name: {WORD}",
    ),
    (
        '[hip, knee]',
        '[hip, "kn\\nee"]',
        f"6: {LEG}, field joints: found the text 'kn\\nee', allowed: a joint name: {NAME}",
    ),
    (
        '[hip, knee]',
        '[hip,\n      hip]',
        f'7: {LEG}, field joints: found joint hip again, allowed: each joint once',
    ),
    (
        '[hip, knee]',
        'hip',
        f"6: {LEG}, field joints: found 'hip', allowed: a list of joint names",
    ),
    (
        '[hip, knee]',
        '[]',
        f'6: {LEG}, field joints: found an empty list, '
        'allowed: a list of joint names, at least one',
    ),
    (
        GOOD,
        GOOD + GOOD[GOOD.index('  leg:') :].replace('  leg:', '  arm:'),
        '26: chain arm, field tip: found foot, the tip of chain leg, '
        'allowed: another tip for each chain',
    ),
    (
        GOOD[GOOD.index('      dh') : GOOD.index('    versions')],
        '      {}\n',
        f'8: {LEG}, field tip_frames: found none, allowed: at least one tip frame',
    ),
    (
        'root_link',
        '/root_link',
        f"5: {LEG}, field root_frame: found '/root_link', allowed: a frame id: {FRAME}",
    ),
    (
        'foot_dh',
        'root_link',
        f"8: {LEG}, field tip_frames, dh, field frame: found 'root_link', "
        'allowed: another frame id than the root frame',
    ),
    (
        '{frame: foot_dh}',
        '{}',
        f'8: {LEG}, field tip_frames, dh, field frame: found nothing, allowed: all of frame',
    ),
    (
        GOOD[GOOD.index('versions') :],
        'versions: {}',
        f'12: {LEG}, field versions: found none, allowed: at least one version',
    ),
    (
        GOOD,
        GOOD + '      v1: {}\n',
        f'25: {V1}: found a duplicate key, allowed: each key once',
    ),
    (
        'T_nIs:',
        'T_nls:',
        f"24: {V1}: found unknown key 'T_nls' (did you mean 'T_nIs'?), allowed: {VERSION}",
    ),
    (
        GOOD,
        'default_version: v2\n' + GOOD,
        f"1: {FILE}, field default_version: found 'v2', allowed: a version of the file: v1",
    ),
    (
        '    versions:',
        '    default_version: v2\n    versions:',
        f"12: {LEG}, field default_version: found 'v2', allowed: v1",
    ),
    (
        '    joints',
        '    root_axes: [forward, right, up]\n    joints',
        f'6: {LEG}, field root_axes: found forward, right, up, '
        'allowed: directions of x, y, z that make a right-handed frame',
    ),
    (
        '    joints',
        '    root_axes: [north, right, up]\n    joints',
        f"6: {LEG}, field root_axes: found 'north', "
        'allowed: forward or backward or left or right or up or down',
    ),
    (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2], [3, 4]]\n',
        f'11: {LEG}, field tip_frames, sole, field outline: found 2, '
        'allowed: at least three corners',
    ),
    (
        'foot_sole\n',
        'foot_sole\n        outline: [[1, 2, 3]]\n',
        f'11: {LEG}, field tip_frames, sole, field outline: found 3 items, allowed: [x, y]',
    ),
    (
        '"somewhere"',
        '|\n          some\n          where',
        f"14: {V1}, field source: found the text 'some\\nwhere\\n', allowed: text of one line",
    ),
    (
        '          - [0, 0, 0, 1]\n',
        '',
        f'16: {V1}, field T_Ro0: found 3 items, allowed: 4 rows of 4 numbers',
    ),
    (
        '[0, -1, 0, -119.9]',
        '[0, -1, 0]',
        f'18: {V1}, field T_Ro0, row 2: found 3 items, allowed: a row of 4 numbers',
    ),
    (
        '[0, -1, 0, -119.9]',
        '[0, -1, o, -119.9]',
        f"18: {V1}, field T_Ro0, row 2, column 2: found 'o', allowed: a finite number",
    ),
    (
        '[1, 0, 0, 5]',
        '[2, 0, 0, 5]',
        f'16: {V1}, field T_Ro0: found a matrix that is not a rigid transform, allowed: {RIGID}',
    ),
    (
        '[1, 0, 0, 0], [0, 0, 0, 1]]',
        '[1, 0, 0, 0], [0, 0, 1, 1]]',
        f'11: {LEG}, field tip_frames, sole, field transform: '
        f'found a matrix that is not a rigid transform, allowed: {RIGID}',
    ),
    (
        GOOD[GOOD.index('          - {a: 30') : GOOD.index('          - {a: 1,')],
        '',
        f'21: {V1}, field links: found 1 row with a joint, '
        'allowed: 2, one per joint that no row names',
    ),
    (
        GOOD[GOOD.index('        links:') : GOOD.index('        T_nIs')],
        '        links: []\n',
        f'20: {V1}, field links: found an empty list, allowed: a list of rows, at least one',
    ),
    ('d: 20, ', '', f'21: {ROW_0}, field d: found nothing, allowed: all of {DH}'),
    (
        'offset: 0, type',
        'ofset: 0, type',
        f"22: {ROW_1}: found unknown key 'ofset' (did you mean 'offset'?), allowed: {ROW}",
    ),
    (
        'offset: 0, type',
        'theta: 0, type',
        f'22: {ROW_1}: found key theta, allowed: offset instead',
    ),
    (
        'offset: 90',
        'offset: 90, sign: -1',
        f'21: {ROW_0}: found key sign, allowed: gain instead',
    ),
    (
        'offset: 90',
        'offset: 90, gain: 0',
        f"21: {ROW_0}, field gain: found '0', allowed: a number other than 0",
    ),
    (
        'offset: 90',
        'offset: 90, joint: kne',
        f"21: {ROW_0}, field joint: found 'kne', allowed: hip or knee",
    ),
    (
        '{a: 1, d: 6.6',
        '{joint: hip, a: 1, d: 6.6',
        f"23: {V1}, row 2, field joint: found 'hip', "
        'allowed: nothing, since a fixed row has no joint',
    ),
    (
        '{a: 1, d: 6.6, alpha: 90, offset: 0, type: fixed}',
        '{a: 1, d: 6, alpha: 90, joint: hip}\n'
        '          - {a: 1, d: 6, alpha: 90, joint: hip, range: [0, 1]}',
        f'24: {V1}, row 3, field range: found a list, '
        'allowed: nothing: the range of joint hip stands on the first row that it moves',
    ),
    (
        '{a: 30',
        '{a: 30, a: 31',
        f'22: {ROW_1}, field a: found a duplicate key, allowed: each key once',
    ),
    (
        'a: 10',
        'a: "10"',
        f"21: {ROW_0}, field a: found the text '10', allowed: {NUMBER_MM}",
    ),
    ('d: 20', 'd: .nan', f"21: {ROW_0}, field d: found '.nan', allowed: {NUMBER_MM}"),
    ('d: 20', 'd: 1e999', f"21: {ROW_0}, field d: found '1e999', allowed: {NUMBER_MM}"),
    (
        'a: 10',
        'a: -1e300',
        f"21: {ROW_0}, field a: found '-1e300', allowed: a length up to 1e+09 m",
    ),
    (
        'alpha: -90',
        'alpha: 1:30',
        f"21: {ROW_0}, field alpha: found '1:30', allowed: {NUMBER_DEG}",
    ),
    (
        'alpha: -90',
        'alpha: pi/0',
        f"21: {ROW_0}, field alpha: found 'pi/0', allowed: {NUMBER_DEG}",
    ),
    (
        'offset: 90',
        'offset: 90 deg',
        f"21: {ROW_0}, field offset: found '90 deg', allowed: {NUMBER_DEG}",
    ),
    ('a: 10', 'a: ', f'21: {ROW_0}, field a: found nothing, allowed: {NUMBER_MM}'),
    (
        '[-44, 132]',
        '[132, -44]',
        f"21: {ROW_0}, field range: found '132' above '-44', allowed: lower at most upper",
    ),
    (
        '[-44, 132]',
        '132',
        f"21: {ROW_0}, field range: found '132', allowed: [lower, upper]",
    ),
    (
        'prismatic',
        'screw',
        f"22: {ROW_1}, field type: found 'screw', allowed: revolute or prismatic or fixed",
    ),
    (
        '"odd"',
        '"odd\\neven"',
        f"22: {ROW_1}, field erratum: found the text 'odd\\neven', allowed: text of one line",
    ),
    (
        '{a: 1, d: 6.6',
        '{range: [0, 1], a: 1, d: 6.6',
        f'23: {V1}, row 2, field range: found a list, '
        'allowed: nothing, since a fixed row has no joint',
    ),
    (
        '[-44, 132]',
        '[-44, 132], robot_range: [1, 0]',
        f"21: {ROW_0}, field robot_range: found '1' above '0', allowed: lower at most upper",
    ),
    (
        '        T_nIs',
        '        virtual_link: {a: 1}\n        T_nIs',
        f'24: {V1}: found key virtual_link, '
        'allowed: a last row such as {a: 0, d: 6.6, alpha: 90, type: fixed} instead',
    ),
    (
        '        T_nIs',
        '        convention: craig\n        T_nIs',
        f"24: {V1}, field convention: found 'craig', allowed: standard or modified",
    ),
    (
        'a: 30',
        'a: !!python/object/apply:os.system [true]',
        f'22: {ROW_1}, field a: found a list, allowed: {NUMBER_MM}',
    ),
    (
        'a: 30',
        'a: &a [*a]',
        f'22: {ROW_1}, field a: found a list, allowed: {NUMBER_MM}',
    ),
    (
        'a: 30',
        'a: ' + 'x' * 200_000,
        f"""22: {ROW_1}, field a: found '{27 * 'x'}...{28 * 'x'}', allowed: {NUMBER_MM}""",
    ),
]


@pytest.mark.parametrize(
    ('old', 'new', 'said'), MISTAKES, ids=[said[:60] for _, _, said in MISTAKES]
)
def test_a_mistake_is_one_line_with_place_found_and_allowed(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    assert old in GOOD
    file = write(tmp_path, GOOD.replace(old, new, 1))
    error = refusal(file)
    assert str(error) == f'{file}:{said}'
    place = f'{error.line}: {error.where}'
    assert said == f'{place}: found {error.found}, allowed: {error.allowed}'


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


@pytest.mark.parametrize(('old', 'new', 'said'), [*MISTAKES[1:8:3], *MISTAKES[-3:-1]])
def test_a_mistake_reads_the_same_where_pyyaml_has_no_libyaml(
    old: str, new: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(yaml_fields, 'Loader', yaml.BaseLoader)
    test_a_mistake_is_one_line_with_place_found_and_allowed(old, new, said, tmp_path)


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
    assert str(refusal(0)).startswith('cannot read 0: ')
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
