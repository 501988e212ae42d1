"""`leg_fk explain` with sympy: exact numbers, formulas, and the LaTeX of both."""

import json
import re
import subprocess
import sys

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.explain_cases import (
    EXAMPLES,
    explain,
    in_metres,
    LONG_ARM,
    one_chain_of_each_kind,
    positions,
)

sympy = pytest.importorskip('sympy')


def evaluator(e):
    """Turn the formulas of the JSON into a function of q, by sympy's own parser and lambdify."""
    q = sympy.symbols([f'q_{i}' for i in range(len(e['joints']))])
    T = sympy.Matrix(e['T_root_tip'])
    meanings = [(sympy.Symbol(name), sympy.sympify(text)) for name, text in e['symbols'].items()]
    for _ in range(2):  # c_34 is a function of theta_3, which is one of q_3
        T = T.subs(meanings)
    return sympy.lambdify([q], T, 'numpy')


@one_chain_of_each_kind
def test_the_formula_gives_the_chains_pose_everywhere(words, chain):
    formula = evaluator(json.loads(explain(*words, '--symbolic', '--json')))
    for q in np.random.default_rng(5).uniform(-3, 3, (50, chain.n)):
        in_mm = [1000 * x if link.is_prismatic else x
                 for x, link in zip(q, chain.joints, strict=True)]
        assert np.abs(in_metres(formula(in_mm)) - chain.forward(q)).max() < 1e-12


def test_the_sum_of_joints_1_and_2_is_not_joint_12(tmp_path):
    file = tmp_path / 'long_arm.yaml'
    file.write_text(LONG_ARM)
    chain = Catalog.load(file).chain('arm', 'v1')
    e = json.loads(explain('arm', '-k', file, '--version', 'v1', '--symbolic', '--json'))
    assert {'c_1_2', 'c_12'} <= e['symbols'].keys()
    formula = evaluator(e)
    for q in np.random.default_rng(6).uniform(-3, 3, (20, 13)):
        in_mm = [1000 * x if link.is_prismatic else x
                 for x, link in zip(q, chain.joints, strict=True)]
        assert np.abs(in_metres(formula(in_mm)) - chain.forward(q)).max() < 1e-12


@one_chain_of_each_kind
def test_exact_numbers_are_the_chains_pose(words, chain):
    q = positions(chain, 6)
    e = json.loads(explain(*words, '--symbolic', '--json', '--radians', *q))
    T = np.array(sympy.Matrix(evaluator(e)([0] * len(q))), dtype=float)
    assert np.abs(in_metres(T) - chain.forward(q)).max() < 1e-12


def test_right_angles_and_lengths_are_exact():
    e = json.loads(explain('left_leg', '--symbolic', '--json', '--degrees', 0, 0, 0, -30, 0, 0))
    assert [link['alpha'] for link in e['links']] == ['-pi/2', '-pi/2', 'pi/2', 'pi', '-pi/2', '0']
    assert [link['theta'] for link in e['links']][:4] == ['pi/2', 'pi/2', '-pi/2', 'pi/3']
    assert [link['a'] for link in e['links']] == ['0', '0', '-367/400', '-401/2', '0', '-1361/20']
    assert not re.search(r'\d\.\d', json.dumps(e['T_root_tip']))
    assert sympy.sympify(e['T_root_tip'][2][0]) == sympy.sqrt(3) / 2


def test_radians_that_are_whole_degrees_are_recognised():
    e = json.loads(explain('left_leg', '--symbolic', '--json', '--radians',
                           0.5235987755982988, 0.5, 0, 0, 0, 0))
    assert [link['theta'] for link in e['links']][:2] == ['2*pi/3', '1/2 + pi/2']


def test_parallel_axes_add_their_angles():
    text = explain('left_leg')
    assert 'c_3m4    = cos(theta_3 - theta_4)' in text
    assert 'r_23 = c_1 c_3m4 - c_2 s_1 s_3m4' in text
    assert 'c_123    = cos(theta_1 + theta_2 + theta_3)' in explain(
        'ur5', '-k', EXAMPLES / 'ur5.yaml', '--version', 'series_3')


def test_no_joint_values_and_symbolic_without_values_are_the_same():
    assert explain('right_leg') == explain('right_leg', '--symbolic')


def test_formulas_take_seconds_not_minutes():
    command = [sys.executable, '-m', 'icub_leg_fk', 'explain']
    for chain in (['left_leg'], ['head_imu', '--version', 'v2']):
        assert subprocess.run([*command, *chain], capture_output=True, timeout=60).returncode == 0


def test_without_sympy_decimals_still_work_and_symbols_say_what_is_missing():
    program = ("import sys; sys.modules['sympy'] = None; "
               'from icub_leg_fk.__main__ import main; sys.exit(main(sys.argv[1:]))')
    zeros = ['--degrees', *['0'] * 6]
    for words, status in ((zeros, 0), (['--json', *zeros], 0), (['--latex', *zeros], 0), ([], 2)):
        done = subprocess.run([sys.executable, '-c', program, 'explain', 'left_leg', *words],
                              capture_output=True, text=True, timeout=60)
        assert done.returncode == status, done.stderr
    assert done.stderr.count('\n') == 1 and 'pip install sympy' in done.stderr


@pytest.mark.parametrize('values', ['none', 'decimals', 'exact'])
@one_chain_of_each_kind
def test_latex_is_balanced_and_complete(words, chain, values):
    q = ['--radians', *positions(chain, 7)] if values != 'none' else []
    document = explain(*words, '--latex', *q, *(['--symbolic'] if values == 'exact' else []))
    assert document.startswith(r'\documentclass') and document.rstrip().endswith(r'\end{document}')
    open_environments = []
    for kind, name in re.findall(r'\\(begin|end)\{([a-z]+\*?)\}', document):
        if kind == 'begin':
            open_environments.append(name)
        else:
            assert open_environments.pop() == name
    assert open_environments == []
    bare = re.sub(r'\\[\\{}$&%#_]', '', document)
    depth = 0
    for letter in bare:
        depth += (letter == '{') - (letter == '}')
        assert depth >= 0
    assert depth == 0
    assert bare.count('$') % 2 == 0
    assert bare.count(r'\left(') == bare.count(r'\right)')
    assert bare.count(r'\[') == bare.count(r'\]')
    outside = re.sub(r'\$[^$]*\$|\\\[.*?\\\]|\\begin\{align\*\}.*?\\end\{align\*\}', '',
                     re.sub(r'\\[{}$&%#_]', '', document), flags=re.DOTALL)
    assert '_' not in outside and '^' not in outside.replace(r'\^{}', '').replace(r'\^', '')
    assert f'{len(chain.links) - 1}}}' in document


@one_chain_of_each_kind
def test_every_row_of_a_latex_matrix_has_four_entries(words, chain):
    document = explain(*words, '--latex')
    matrices = re.findall(r'\\begin\{bmatrix\}(.*?)\\end\{bmatrix\}', document, re.DOTALL)
    assert len(matrices) > 5
    for matrix in matrices:
        rows = matrix.strip().split('\\\\')
        assert [row.count('&') for row in rows] == [3, 3, 3, 3]
