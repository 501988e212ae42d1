"""Conventions of DH tables: roboticstoolbox's own models, the maker's Panda, what is mended."""

from dataclasses import replace
from pathlib import Path

from icub_leg_fk.errors import CatalogError
from icub_leg_fk.kinematics import Catalog, DHLink, load_chain
from icub_leg_fk.kinematics.link import modified_rows, standard_rows
import numpy as np
import pytest
from support.any_chain import chain_of
from support.oracle import rotation_x, rotation_z, translation

EXAMPLES = Path(__file__).resolve().parents[2] / 'config' / 'examples'
TOLERANCE = 1e-12


def models():
    """Return every model of roboticstoolbox that is a DH table and loads."""
    try:
        from roboticstoolbox.models import DH
    except ImportError as error:  # of what it needs, too; pytest 7 has no word for that
        pytest.skip(f'needs roboticstoolbox: {error}')
    found = {}
    for name in sorted(vars(DH)):
        made = getattr(DH, name)
        if isinstance(made, type):
            try:
                model = made()
            except Exception:  # noqa: BLE001 (some need what is not installed)
                continue
            if not any('sym' in str(type(link.a)) for link in model.links):
                found[name] = model
    return found


def row_as_yaml(link):
    # Its standard links slide along z by q; theta and d are what the joint does not move.
    offset, d, more = float(link.offset), float(link.d), ''
    if link.isprismatic:
        offset, d, more = float(link.theta), d + offset, ', type: prismatic'
    if link.isflip:
        more += ', gain: -1'
    a, alpha = float(link.a), float(link.alpha)
    return f'a: {a!r}, d: {d!r}, alpha: {alpha!r}, offset: {offset!r}{more}'


def matrix(T):
    return str(np.asarray(T, dtype=float).tolist())


def as_yaml(model):
    """Return a model of roboticstoolbox as a kinematics file, every digit of it."""
    lines = ''.join(f'          - {{{row_as_yaml(link)}}}\n' for link in model.links)
    names = ', '.join(f'q{i}' for i in range(len(model.links)))
    return f"""
units: {{length: m, angle: rad}}
chains:
  robot:
    tip: tip
    root_frame: base
    joints: [{names}]
    tip_frames: {{tool: {{frame: tool}}}}
    versions:
      v1:
        convention: {'modified' if model.mdh else 'standard'}
        T_Ro0: {matrix(model.base.A)}
        links:
{lines}        T_nIs: {matrix(model.tool.A)}
"""


def largest_length(model):
    return max(1.0, *(abs(float(link.a)) + abs(float(link.d)) for link in model.links))


def test_the_models_of_roboticstoolbox_are_computed_exactly(written):
    found = models()
    modified = [name for name, model in found.items() if model.mdh]
    sliding = [name for name, model in found.items() if any(model.prismaticjoints)]
    assert len(found) >= 20 and modified and sliding
    rng = np.random.default_rng(20)
    for name, model in found.items():
        chain = Catalog.load(written(as_yaml(model))).chain('robot')
        allowed = TOLERANCE * largest_length(model)
        for q in rng.uniform(-3, 3, (6, chain.n)):
            frames = np.array([T.A for T in model.fkine_all(q)])
            expected = model.fkine(q).A
            assert np.abs(chain.frames(q)[:-1] - frames).max() < allowed, name
            assert np.abs(chain.forward(q) - expected).max() < allowed, name
            assert (
                np.abs(np.array(chain.pose(q)[:3]) - expected[:3, 3]).max() < allowed
            ), name


def test_the_makers_panda_is_roboticstoolboxs():
    panda = load_chain('panda', 'fci', file=EXAMPLES / 'panda.yaml')
    model = pytest.importorskip('roboticstoolbox', reason='needs it').models.DH.Panda()
    assert panda.n == 7 and len(panda.links) == 8
    for q in np.random.default_rng(21).uniform(-2, 2, (20, 7)):
        flange = model.fkine(q).A @ np.linalg.inv(model.tool.A)
        assert np.abs(panda.forward(q) - flange).max() < TOLERANCE


def test_a_modified_chain_gives_and_prints_its_rows_as_craig_does():
    panda = load_chain('panda', 'fci', file=EXAMPLES / 'panda.yaml')
    rows = [row.link for row in panda.rows()]
    assert [row.a for row in rows] == [0, 0, 0, 0.0825, -0.0825, 0, 0.088, 0]
    assert np.degrees([row.alpha for row in rows]) == pytest.approx(
        [0, -90, 90, 90, -90, 90, 90, 0]
    )
    assert 'modified' in str(panda).splitlines()[0]
    assert str(panda).splitlines()[5].split()[:4] == ['3', 'panda_joint4', '82.5', '0']


FIXED, PLAIN = DHLink(0, 0, 0, joint_type='fixed'), DHLink(0, 0.2, 0, 0.3)
TURN, SHIFTED = DHLink(0.1, 0, 0.7, -0.2), DHLink(0.3, 0, -0.4, joint_type='fixed')


@pytest.mark.parametrize(
    'rows',
    [
        (PLAIN,),
        (TURN,),
        (FIXED, TURN),
        (SHIFTED, PLAIN),
        (FIXED, FIXED, PLAIN),
        (TURN, SHIFTED),
        (SHIFTED, TURN, PLAIN),
        (PLAIN, FIXED),
    ],
)
def test_modified_rows_come_back_and_give_craigs_frames(rows):
    assert modified_rows(standard_rows(rows)) == rows
    chain = replace(chain_of(standard_rows(rows)), convention='modified')
    q = [0.4] * chain.n
    frames = [np.eye(4)]
    for row in rows:
        turned = rotation_z(row.offset + (0.0 if row.is_fixed else 0.4))
        before = rotation_x(row.alpha) @ translation(row.a, 0, 0)
        frames.append(frames[-1] @ before @ turned @ translation(0, 0, row.d))
    assert chain.frames(q) == pytest.approx(np.array([*frames, frames[-1]]), abs=1e-15)
    assert chain.forward(q) == pytest.approx(frames[-1], abs=1e-15)
    assert chain.pose(q)[:3] == pytest.approx(frames[-1][:3, 3], abs=1e-15)


ARM = """
units: {length: m, angle: rad}
chains:
  arm:
    tip: hand
    root_frame: base
    joints: [turn, slide]
    tip_frames: {tool: {frame: tool}, pad: {frame: pad, transform: [[0.7071, -0.7071, 0, 0],
      [0.7071, 0.7071, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]]}}
    versions:
      v1:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0.5, d: 0, alpha: pi/2, offset: -pi/2, gain: -1}
          - {a: 0, d: 0.2, alpha: pi, offset: 3*pi/4, type: prismatic, gain: -1}
      v2:
        root_frame: other_base
        joints: [swing, push]
        tip_frames: {claw: {frame: claw}}
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {a: 0.5, d: 0, alpha: 0, offset: 0}
          - {a: 250, d: 0, alpha: 90, offset: 0}
"""


@pytest.fixture
def arm(written):
    return written(ARM)


def test_fractions_of_pi_are_exact_and_a_gain_turns_a_joint_around(arm):
    chain = Catalog.load(arm).chain('arm', 'v1')
    assert [link.alpha for link in chain.links] == [np.pi / 2, np.pi]
    assert [link.offset for link in chain.links] == [-np.pi / 2, 3 * np.pi / 4]
    assert [link.gain for link in chain.links] == [-1, -1]
    c, s = np.cos(-np.pi / 2 - 0.3), np.sin(-np.pi / 2 - 0.3)
    expected = [0.5 * c + 0.1 * s, 0.5 * s - 0.1 * c, 0]
    assert chain.forward([0.3, 0.1])[:3, 3] == pytest.approx(expected, abs=1e-15)


def test_a_version_says_otherwise_what_its_chain_says(arm):
    one, two = (Catalog.load(arm).chain('arm', version) for version in ('v1', 'v2'))
    assert (one.root_frame, one.joint_names, one.frame_id) == (
        'base',
        ('turn', 'slide'),
        'tool',
    )
    assert (two.root_frame, two.joint_names, two.frame_id) == (
        'other_base',
        ('swing', 'push'),
        'claw',
    )
    assert one.tip == two.tip == 'hand'


def test_what_can_hardly_be_meant_is_computed_and_reported(arm):
    rotation, length, angle = Catalog.load(arm).warnings
    assert (
        f'{arm}:8: chain arm, field tip_frames, pad, field transform: the rot'
        in rotation
    )
    assert (
        f'{arm}:23: chain arm, version v2, row 1, field a: 250 m is unlikely' in length
    )
    assert (
        f'{arm}:23: chain arm, version v2, row 1, field alpha: 90 rad is unlike'
        in angle
    )
    R = Catalog.load(arm).chain('arm', 'v1', 'pad').forward([0, 0])[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-15
    with pytest.warns(UserWarning) as warned:
        load_chain('arm', 'v1', file=arm)
    assert [str(warning.message) for warning in warned] == [rotation, length, angle]
    assert {warning.filename for warning in warned} == {__file__}


@pytest.mark.parametrize(
    ('units', 'row', 'doubt'),
    [
        ('mm, angle: deg', 'a: 0.3, d: 0, alpha: 90', '0.3 mm for the longest length'),
        ('mm, angle: deg', 'a: 0, d: 0, alpha: 90', ''),
        ('mm, angle: deg', 'a: 6, d: 0, alpha: 90', ''),
        (
            'm, angle: deg',
            'a: 30, d: 0, alpha: 90',
            '30 m is unlikely; the unit of leng',
        ),
        ('m, angle: deg', 'a: 1, d: 0, alpha: 45.5, offset: -0.78', ''),
        ('m, angle: deg', 'a: 1, d: 0, alpha: 1.5708', '1.5708 deg is unlikely, since'),
        (
            'm, angle: deg',
            'a: 1, d: 0, alpha: 3.14',
            '3.14 deg is unlikely, since it i',
        ),
        (
            'm, angle: deg',
            'a: 1, d: 0, alpha: 0, offset: -3.142',
            '-3.142 deg is unlike',
        ),
        ('m, angle: rad', 'a: 1, d: 0, alpha: 90', '90 rad is unlikely'),
        (
            'm, angle: rad',
            'a: 1, d: 0, alpha: 1.57',
            '1.57 rad is 0.0008 rad from pi/2',
        ),
        (
            'm, angle: rad',
            'a: 1, d: 0, alpha: -3.14',
            '-3.14 rad is 0.002 rad from -pi',
        ),
        ('m, angle: rad', 'a: 1, d: 0, alpha: 1.5708', ''),
        ('m, angle: rad', 'a: 1, d: 0, alpha: pi/2', ''),
        ('m, angle: rad', 'a: 1, d: 0, alpha: 1.55', ''),
    ],
)
def test_a_table_in_another_unit_is_doubted(units, row, doubt, written):
    file = written(
        f'units: {{length: {units}}}\nchains:\n  arm:\n    tip: tool\n'
        '    root_frame: base\n    joints: [j]\n    tip_frames: {dh: {frame: t}}\n'
        f'    versions: {{v1: {{links: [{{{row}}}]}}}}\n'
    )
    warnings = Catalog.load(file).warnings
    assert len(warnings) == bool(doubt) and doubt in ''.join(warnings)


def test_three_decimals_are_too_few_for_a_rotation(arm):
    arm.write_text(ARM.replace('0.7071', '0.707'))
    with pytest.raises(CatalogError, match=r'not a rigid transform.*four decimals'):
        Catalog.load(arm)


def test_two_catalogs_of_one_table_are_equal_whatever_their_path(arm, written):
    copy = written(ARM.replace('d: 0.2', 'd: 0.20'), 'copy')
    one, two = Catalog.load(arm), Catalog.load(copy)
    assert one == two and hash(one) == hash(two) and Catalog.load() == Catalog.load()
    copy.write_text(ARM.replace('d: 0.2', 'd: 0.21'))
    assert Catalog.load(copy) != one
    with pytest.raises(ValueError, match='read-only'):
        one.entry('arm').versions['v1'].T_root_0[0, 3] = 1.0
