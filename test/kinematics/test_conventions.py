"""Conventions of DH tables: roboticstoolbox's own models, the maker's Panda, what is mended."""

from pathlib import Path
from typing import Any

from icub_leg_fk.__main__ import main
from icub_leg_fk.errors import CatalogError
from icub_leg_fk.kinematics import Catalog, load_chain
from icub_leg_fk.kinematics.chain import modified_rows
import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / 'config' / 'examples'
TOLERANCE = 1e-12


def models() -> dict[str, Any]:
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


def as_yaml(model: Any) -> str:
    """Return a model of roboticstoolbox as a kinematics file, every digit of it."""
    def matrix(T: Any) -> str:
        return str(np.asarray(T, dtype=float).tolist())

    rows = []
    for link in model.links:
        # Its standard links slide along z by q; theta and d are what the joint does not move.
        slides = bool(link.isprismatic)
        offset = float(link.theta) if slides else float(link.offset)
        d = float(link.d) + float(link.offset) if slides else float(link.d)
        rows.append(f'{{a: {float(link.a)!r}, d: {d!r}, alpha: {float(link.alpha)!r}, '
                    f'offset: {offset!r}{", type: prismatic" * slides}'
                    f'{", sign: -1" * bool(link.isflip)}}}')
    lines = ''.join(f'          - {row}\n' for row in rows)
    return f"""
units: {{length: m, angle: rad}}
chains:
  robot:
    tip: tip
    root_frame: base
    joints: [{', '.join(f'q{i}' for i in range(len(rows)))}]
    tip_frames: {{tool: {{frame: tool}}}}
    versions:
      v1:
        convention: {'modified' if model.mdh else 'standard'}
        T_Ro0: {matrix(model.base.A)}
        links:
{lines}        T_nIs: {matrix(model.tool.A)}
"""


def test_the_models_of_roboticstoolbox_are_computed_exactly(tmp_path: Path) -> None:
    found = models()
    modified = {name for name, model in found.items() if model.mdh}
    slides = {name for name, model in found.items()
              if any(link.isprismatic for link in model.links)}
    assert len(found) >= 20 and modified and slides
    rng = np.random.default_rng(20)
    for name, model in found.items():
        file = tmp_path / f'{name}.yaml'
        file.write_text(as_yaml(model))
        chain = Catalog.load(file).chain('robot', 'v1')
        scale = max(1.0, max(abs(float(link.a)) + abs(float(link.d)) for link in model.links))
        for q in rng.uniform(-3, 3, (20, chain.n)):
            expected = model.fkine(q).A
            assert np.abs(chain.forward(q) - expected).max() < TOLERANCE * scale, name
            assert np.abs(np.array(chain.pose(q)[:3]) - expected[:3, 3]).max() < TOLERANCE * scale


def test_the_makers_panda_is_roboticstoolboxs() -> None:
    panda = load_chain('panda', 'fci', file=EXAMPLES / 'panda.yaml')
    model = pytest.importorskip('roboticstoolbox', reason='needs it').models.DH.Panda()
    assert panda.n == 7 and len(panda.links) == 8
    for q in np.random.default_rng(21).uniform(-2, 2, (20, 7)):
        flange = model.fkine(q).A @ np.linalg.inv(model.tool.A)
        assert np.abs(panda.forward(q) - flange).max() < TOLERANCE


def test_modified_rows_are_those_of_the_file_and_print_as_such() -> None:
    panda = load_chain('panda', 'fci', file=EXAMPLES / 'panda.yaml')
    rows = modified_rows(panda)
    assert [row.a for row in rows] == [0, 0, 0, 0.0825, -0.0825, 0, 0.088, 0]
    assert np.degrees([row.alpha for row in rows]) == pytest.approx(
        [0, -90, 90, 90, -90, 90, 90, 0])
    assert 'modified' in str(panda).splitlines()[0]
    assert str(panda).splitlines()[5].split()[:4] == ['3', 'panda_joint4', '82.5', '0']


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
          - {a: 0.5, d: 0, alpha: pi/2, offset: -pi/2, sign: -1}
          - {a: 0, d: 0.2, alpha: pi, offset: 3*pi/4, type: prismatic, sign: -1}
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
def arm(tmp_path: Path) -> Path:
    file = tmp_path / 'arm.yaml'
    file.write_text(ARM)
    return file


def test_fractions_of_pi_are_exact_and_a_sign_turns_a_joint_around(arm: Path) -> None:
    chain = Catalog.load(arm).chain('arm', 'v1')
    assert [link.alpha for link in chain.links] == [np.pi / 2, np.pi]
    assert [link.offset for link in chain.links] == [-np.pi / 2, 3 * np.pi / 4]
    forward = Catalog.load(arm)
    assert forward.chain('arm', 'v1').forward([0.3, 0.1])[:3, 3] == pytest.approx(
        [0.5 * np.cos(-np.pi / 2 - 0.3) + 0.1 * np.sin(-np.pi / 2 - 0.3),
         0.5 * np.sin(-np.pi / 2 - 0.3) - 0.1 * np.cos(-np.pi / 2 - 0.3), 0], abs=1e-15)


def test_a_version_says_otherwise_what_its_chain_says(arm: Path) -> None:
    one, two = (Catalog.load(arm).chain('arm', version) for version in ('v1', 'v2'))
    assert (one.root_frame, one.joint_names, one.tip_frame) == ('base', ('turn', 'slide'), 'tool')
    assert (two.root_frame, two.joint_names, two.tip_frame) == (
        'other_base', ('swing', 'push'), 'claw')
    assert one.tip == two.tip == 'hand'


def test_what_can_hardly_be_meant_is_computed_and_said(arm: Path,
                                                       capsys: pytest.CaptureFixture) -> None:
    rotation, length, angle = Catalog.load(arm).warnings
    assert f'{arm}:8: chain arm, field tip_frames, pad, field transform: the rot' in rotation
    assert f'{arm}:23: chain arm, version v2, row 1, field a: 250 m is unlikely' in length
    assert f'{arm}:23: chain arm, version v2, row 1, field alpha: 90 rad is unlike' in angle
    R = Catalog.load(arm).chain('arm', 'v1', 'pad').forward([0, 0])[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-15
    with pytest.warns(UserWarning, match='the rotation is rounded'):
        load_chain('arm', 'v1', file=arm)
    assert main(['pose', 'arm', '-k', str(arm), '--version', 'v1', '--radians', '0', '0']) == 0
    assert capsys.readouterr().err.count('leg_fk: warning: ') == 3


def test_three_decimals_are_too_few_for_a_rotation(arm: Path) -> None:
    arm.write_text(ARM.replace('0.7071', '0.707'))
    with pytest.raises(CatalogError, match=r'not a rigid transform.*four decimals'):
        Catalog.load(arm)


def test_two_catalogs_of_one_table_are_equal_whatever_their_path(arm: Path,
                                                                 tmp_path: Path) -> None:
    (tmp_path / 'copy.yaml').write_text(ARM.replace('d: 0.2', 'd: 0.20'))
    one, two = Catalog.load(arm), Catalog.load(tmp_path / 'copy.yaml')
    assert one == two and hash(one) == hash(two) and Catalog.load() == Catalog.load()
    (tmp_path / 'copy.yaml').write_text(ARM.replace('d: 0.2', 'd: 0.21'))
    assert Catalog.load(tmp_path / 'copy.yaml') != one
    with pytest.raises(ValueError, match='read-only'):
        one.entry('arm').versions['v1'].T_root_0[0, 3] = 1.0
