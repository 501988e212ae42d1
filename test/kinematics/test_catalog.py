"""The shipped catalog equals the printed documents; looking things up; a user's own file."""

from math import pi, radians
from pathlib import Path
import re
import subprocess
import sys

from icub_leg_fk.errors import CatalogError, LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, catalog, config_file, load_chain
import numpy as np
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
SPEC = ROOT.parent / 'shared' / 'spec'
CATALOG = Catalog.load()
PRINTED = yaml.safe_load(
    (ROOT / 'config' / 'icub_kinematics.yaml').read_text(encoding='utf-8')
)
LEGS = {
    ('left_leg', 'v1'): 'Left-V1',
    ('left_leg', 'v2_5'): 'Left-V2_5',
    ('right_leg', 'v1'): 'Right-V1',
    ('right_leg', 'v2_5'): 'Right-V2_5',
}

needs_spec = pytest.mark.skipif(
    not SPEC.is_dir(),
    reason='the documents are not in ../shared/spec beside this checkout',
)


def section(document, heading):
    """Return the text from a heading to the next one, with its table rules taken out."""
    text = re.sub(r'[|]', ' ', document.replace('&gt;', '>').replace('\\_', '_'))
    text = re.split(rf'^[# ]*{heading}\s*$', text, flags=re.MULTILINE)[1]
    return re.split(
        r'^[# ]*(?:Left|Right|Izquierda|Derecha)-V\S+\s*$', text, flags=re.MULTILINE
    )[0]


def printed_rows(text):
    """Return the cells of a printed DH table, in mm and degrees."""
    degrees = {'0': 0, 'pi/2': 90, '-pi/2': -90, 'pi': 180}
    rows = []
    for line in re.findall(r'^\s*i = \d.*$', text, flags=re.MULTILINE):
        index, a, d, alpha, theta = re.fullmatch(
            r'\s*i = (\d)\s+(\S+)\s+(\S+)\s+(\S+)\s+(.+?)\s*', line
        ).groups()
        assert int(index) == len(rows) or (int(index) == 6 and not rows)
        offset = re.match(r'(-?\d+) \+', theta)
        limits = re.search(r'([-+]?\d+) *- *> *([-+]?\d+)', theta)
        row = {
            'a': float(a),
            'd': float(d),
            'alpha': degrees[alpha],
            'offset': float(offset[1]) if offset else 0.0,
        }
        if limits:
            row['range'] = [float(limits[1]), float(limits[2])]
        rows.append(row)
    return rows


def printed_matrix(text, name):
    """Return the first matrix after its name."""
    number = r'\s*(-?[\d.]+)'
    found = re.search(
        rf'{name}:[\s:-]*?' + rf'(?:{number}{number}{number}{number}\s*\n\s*)' * 4,
        text.replace('\\', '') + '\n',
    )
    values = list(map(float, found.groups()))
    return [values[i : i + 4] for i in range(0, 16, 4)]


def documented_fields(row):
    return {
        key: value
        for key, value in row.items()
        if key not in ('erratum', 'robot_range')
    }


@needs_spec
@pytest.mark.parametrize('language', ['en', 'es'])
@pytest.mark.parametrize(('name', 'version'), LEGS)
def test_leg_tables_are_as_printed(name, version, language):
    heading = LEGS[name, version]
    if language == 'es':
        heading = heading.replace('Left', 'Izquierda').replace('Right', 'Derecha')
    document = next(SPEC.glob('001_*' if language == 'en' else '000_*'))
    text = section(document.read_text(encoding='utf-8'), heading)
    ours = PRINTED['chains'][name]['versions'][version]
    assert [documented_fields(row) for row in ours['links']] == printed_rows(text)
    assert ours['T_Ro0'] == printed_matrix(text, 'T_Ro0')


@needs_spec
def test_head_table_is_as_printed():
    text = next(SPEC.glob('002_*')).read_text(encoding='utf-8').replace('|', ' ')
    table, virtual = text.split('In some circumstances')
    ours = PRINTED['chains']['head_imu']['versions']['v2']
    assert ours['links'] == printed_rows(table)
    assert ours['T_Ro0'] == printed_matrix(table, 'T_Ro0')
    assert ours['T_nIs'] == printed_matrix(table, 'T_nIs')
    assert printed_rows(virtual) == [{'a': 0, 'd': 6.6, 'alpha': 90, 'offset': 0}]


@pytest.mark.parametrize(
    ('name', 'version'),
    [
        (name, version)
        for name, entry in CATALOG.chains.items()
        for version in entry.versions
    ],
)
def test_loaded_tables_are_the_printed_ones_in_metres_and_radians(name, version):
    printed = PRINTED['chains'][name]
    table = printed['versions'][version]
    chain = CATALOG.chain(name, version)
    assert chain.joint_names == tuple(table.get('joints', printed['joints']))
    for link, row in zip(chain.links, table['links'], strict=True):
        assert (link.a, link.d) == (row['a'] / 1000, row['d'] / 1000)
        assert (link.alpha, link.offset) == (
            radians(row['alpha']),
            radians(row['offset']),
        )
        assert (link.lower, link.upper) == tuple(map(radians, row['range']))
        assert link.erratum == row.get('erratum', '')
        assert link.joint_type == 'revolute'
    T = np.array(table['T_Ro0'], dtype=float)
    T[:3, 3] /= 1000
    assert np.array_equal(chain.T_root_0, T)


def test_errata_stand_beside_the_printed_ranges_of_the_documented_legs():
    for name, version in LEGS:
        errata = [link.erratum for link in CATALOG.chain(name, version).links]
        assert [i for i, erratum in enumerate(errata) if erratum] == [1, 4]
        assert 'sign' in errata[1] and 'narrower' in errata[4]


def test_version_3_names_its_source_which_is_not_the_documents():
    for entry in CATALOG.chains.values():
        for version, chain in entry.versions.items():
            assert ('iCubGenova09' in chain.source) == (version == 'v3')


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (
            ('left_arm', 'v2_5'),
            "unknown chain 'left_arm'; known: left_leg, right_leg, head_imu",
        ),
        (
            ('left_foot',),
            "unknown chain 'left_foot'; known: left_leg, right_leg, head_imu; "
            'left_foot is the tip of left_leg',
        ),
        (
            ('r_sole',),
            "unknown chain 'r_sole'; known: left_leg, right_leg, head_imu; "
            'r_sole is the sole frame of right_leg',
        ),
        (
            ('left_leg', 'v2.5'),
            "unknown version 'v2.5' of chain left_leg; did you mean 'v2_5'? known: v1, v2_5, v3",
        ),
        (
            ('head_imu', 'v2', 'sole'),
            "unknown tip frame 'sole' of chain head_imu; known: dh",
        ),
        (
            ('left_leg', 'v2_5', 'toe'),
            "unknown tip frame 'toe' of chain left_leg; known: dh, sole",
        ),
    ],
)
def test_an_unknown_name_lists_the_known_ones(arguments, message):
    with pytest.raises(UnknownNameError) as error:
        CATALOG.chain(*arguments)
    assert str(error.value) == message


def test_a_version_that_one_chain_lacks_is_answered_with_the_way_to_name_it():
    message = r"'v1' of chain head_imu; .*known: v2, v3; .*head_imu=v2"
    with pytest.raises(UnknownNameError, match=message):
        CATALOG.select(['left_leg', 'head_imu'], 'v1')
    chosen = CATALOG.select(['left_leg', 'head_imu=v2'], 'v1')
    assert [(chain.name, chain.version) for chain in chosen] == [
        ('left_leg', 'v1'),
        ('head_imu', 'v2'),
    ]


def test_the_files_default_versions_count_where_none_is_given():
    versions = {name: CATALOG.chain(name).version for name in CATALOG.chains}
    assert versions == {'left_leg': 'v2_5', 'right_leg': 'v2_5', 'head_imu': 'v2'}
    assert load_chain('left_leg').version == 'v2_5'
    assert (
        load_chain('left_leg=v1').version
        == load_chain('left_leg', 'v1').version
        == 'v1'
    )


@pytest.mark.parametrize(
    ('names', 'words'),
    [
        (['left_leg', 'left_leg=v1'], 'chain left_leg is named twice'),
        (
            [],
            'no chain is named; allowed: one or more of left_leg, right_leg, head_imu',
        ),
        (
            ['left_leg=v3', 'right_leg'],
            'left_leg=v3 and right_leg=v2_5 do not go together: x, y, z of '
            'root_link point forward, left, up in the one and backward, '
            'right, up in the other',
        ),
        (
            ['left_leg=v9'],
            "unknown version 'v9' of chain left_leg; known: v1, v2_5, v3",
        ),
        ('left_leg', "chains are 'left_leg'; allowed: a list of names"),
        (['left_leg='], "unknown chain 'left_leg='; did you mean 'left_leg'?"),
    ],
)
def test_chains_that_cannot_be_used_together_are_refused(names, words):
    with pytest.raises(LegFKError) as error:
        CATALOG.select(names)
    assert words in str(error.value)


OWN = """
units: {length: m, angle: rad}
chains:
  crane:
    tip: hook
    root_frame: mast
    joints: [slew, trolley]
    tip_frames: {dh: {frame: hook}}
    versions:
      small:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2.5], [0, 0, 0, 1]]
        links:
          - {a: 0, d: 1e1, alpha: 1.5707963267948966, offset: 1.5707963267948966}
          - {a: .5, d: -2., alpha: 0, offset: 0, type: prismatic, range: [-3, +4]}
          - {a: 0, d: 0.25, alpha: 0, offset: 0, type: fixed}
"""


def test_any_robot_can_be_read_in_metres_and_radians(written):
    chain = Catalog.load(written(OWN)).chain('crane', 'small')
    assert [(link.a, link.d, link.alpha, link.offset) for link in chain.links] == [
        (0, 10, pi / 2, pi / 2),
        (0.5, -2, 0, 0),
        (0, 0.25, 0, 0),
    ]
    assert [(link.joint_type, link.lower, link.upper) for link in chain.joints] == [
        ('revolute', -float('inf'), float('inf')),
        ('prismatic', -3, 4),
    ]
    assert chain.T_root_0[2, 3] == 2.5


def test_shipped_file_is_found_beside_the_sources():
    assert (
        config_file('icub_kinematics.yaml') == ROOT / 'config' / 'icub_kinematics.yaml'
    )
    assert Catalog.load().file == str(ROOT / 'config' / 'icub_kinematics.yaml')


@pytest.mark.parametrize(
    'below_prefix',
    [
        'lib/python3.12/site-packages',
        'local/lib/python3.12/dist-packages',
        'site-packages',
    ],
)
def test_shipped_file_is_found_in_the_prefix_of_an_installation(
    tmp_path, monkeypatch, below_prefix
):
    share = tmp_path / 'share' / 'icub_leg_fk' / 'config'
    share.mkdir(parents=True)
    (share / 'icub_kinematics.yaml').write_text('x')
    module = tmp_path / below_prefix / 'icub_leg_fk' / 'kinematics' / 'catalog.py'
    monkeypatch.setattr(catalog, '__file__', str(module))
    assert config_file('icub_kinematics.yaml') == share / 'icub_kinematics.yaml'


def test_a_missing_shipped_file_lists_the_places_looked_at():
    with pytest.raises(
        CatalogError, match=r'^nothing\.yaml: .*allowed: one of .*config, '
    ):
        config_file('nothing.yaml')


def test_loading_needs_only_the_file(tmp_path):
    """No ROS, no current directory, no environment."""
    code = 'from icub_leg_fk.kinematics import Catalog; print(*Catalog.load().chains)'
    result = subprocess.run(
        [sys.executable, '-c', code],
        cwd=tmp_path,
        env={'PYTHONPATH': str(ROOT)},
        check=True,
        capture_output=True,
        text=True,
    )
    assert result.stdout.split() == ['left_leg', 'right_leg', 'head_imu']
