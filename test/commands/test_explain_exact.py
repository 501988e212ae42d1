"""`leg_fk explain` with sympy: exact numbers, formulas, and the LaTeX of both."""

from itertools import product
import json
import re
import shutil
import subprocess
import sys

from icub_leg_fk.__main__ import main
import numpy as np
import pytest
from support.explain_cases import (
    Case,
    HEAD,
    in_metres,
    LEG,
    ODD_ARM,
    OF_EACH_KIND,
    one_chain_of_each_kind,
    UR5,
)

sympy = pytest.importorskip('sympy')

FORMS = ['formula', 'decimals', 'exact']
in_each_form = pytest.mark.parametrize('form', FORMS)

PRISMATIC = '          - {a: 0, d: 0, alpha: 0, type: prismatic}\n'
TURN = '          - {a: 10, d: 0, alpha: 0}\n'
# More than ten joints, of which 1 and 2 turn about parallel axes, and 12 turns too.
LONG_ARM = f"""\
units: {{length: mm, angle: deg}}
chains:
  arm:
    tip: tip
    root_frame: base
    joints: [j0, j1, j2, j3, j4, j5, j6, j7, j8, j9, j10, j11, j12]
    tip_frames: {{dh: {{frame: tip}}}}
    versions:
      v1:
        links:
          - {{a: 0, d: 0, alpha: 90, type: prismatic}}
{TURN}          - {{a: 0, d: 0, alpha: 90}}
{9 * PRISMATIC}{TURN}"""


def formula(e):
    """Turn the answer of the JSON into a function of q, by sympy's own parser and lambdify."""
    q = sympy.symbols([f'q_{i}' for i in range(len(e['joints']))])
    meanings = {name: sympy.sympify(meaning) for name, meaning in e['symbols'].items()}
    return sympy.lambdify([q], sympy.Matrix(e['T_root_tip']).subs(meanings), 'numpy')


def assert_is_the_pose(case):
    chain, answer = case.chain, formula(case.json())
    scale = [1000 if link.is_prismatic else 1 for link in chain.joints]
    for q in np.random.default_rng(5).uniform(-3, 3, (50, chain.n)):
        assert np.abs(in_metres(answer(q * scale)) - chain.forward(q)).max() < 1e-12


@one_chain_of_each_kind
def test_the_formula_gives_the_chains_pose_everywhere(case):
    assert_is_the_pose(case)


def test_the_sum_of_joints_1_and_2_is_not_joint_12(written):
    case = Case('arm', 'dh', written(LONG_ARM))
    assert_is_the_pose(case)
    assert 'c_(1+2) c_12' in case.explain()


@one_chain_of_each_kind
def test_exact_numbers_are_the_chains_pose(case):
    q, words = case.radians(6)
    T = sympy.Matrix(case.json('--symbolic', *words)['T_root_tip'])
    assert np.abs(in_metres(T.evalf(20)) - case.chain.forward(q)).max() < 1e-12


def test_right_angles_and_lengths_are_exact():
    e = LEG.json('--symbolic', '--degrees', 0, 0, 0, -30, 0, 0)
    exact = {
        'alpha': '-pi/2 -pi/2 pi/2 pi -pi/2 0',
        'theta': 'pi/2 pi/2 -pi/2 pi/3 0 0',
        'a': '0 0 -367/400 -401/2 0 -1361/20',
    }
    for name, cells in exact.items():
        assert [link[name] for link in e['links']] == cells.split()
    assert not re.search(r'\d\.\d', json.dumps(e['T_root_tip']))
    assert sympy.sympify(e['T_root_tip'][2][0]) == sympy.sqrt(3) / 2


def test_what_is_not_simple_is_a_decimal():
    text = LEG.explain('--symbolic', '--degrees', 15, 15, 0, -30, 0, 0)
    assert 'sqrt(3)/2' in text and 'sqrt(6)' not in text and '0.9659' in text


def test_radians_that_are_whole_degrees_are_recognised():
    e = LEG.json('--symbolic', '--radians', 0.5235987755982988, 0.5, 0, 0, 0, 0)
    assert [link['theta'] for link in e['links']][:2] == ['2*pi/3', '1/2 + pi/2']


def test_turns_about_parallel_axes_add_their_angles():
    text = LEG.explain()
    assert 'c_(3-4)  = cos(theta_3 - theta_4)' in text
    assert 'r_23 = c_1 c_(3-4) - c_2 s_1 s_(3-4)' in text
    assert 'c_(1+2+3)  = cos(theta_1 + theta_2 + theta_3)' in UR5.explain()
    assert r'c_{1}\,c_{3-4} - c_{2}\,s_{1}\,s_{3-4}' in LEG.explain('--latex')


def test_no_joint_values_and_symbolic_without_values_are_the_same():
    assert LEG.explain() == LEG.explain('--symbolic')


def test_a_formula_that_would_fill_pages_is_refused(written, capsys):
    file = written(ODD_ARM.read_text().replace('alpha: -pi/2', 'alpha: 1.1'))
    assert main(['explain', 'odd_arm', '-k', str(file)]) == 2
    assert '3 of its alphas are not right angles' in capsys.readouterr().err
    assert Case('odd_arm', 'dh', file).explain('--symbolic', '--degrees', 1, 2, 3, 4)


def test_without_sympy_decimals_still_work_and_symbols_say_what_is_missing():
    program = """import sys
sys.modules['sympy'] = None
from icub_leg_fk.__main__ import main
zeros = ['--degrees', *'000000']
for form in ([], ['--json'], ['--latex']):
    assert main(['explain', 'left_leg', *form, *zeros]) == 0
sys.exit(main(['explain', 'left_leg']))
"""
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.count('\n') == 1 and 'pip install sympy' in done.stderr


def latex(case, form):
    """Return a chain's explanation in LaTeX."""
    _, words = case.radians(7)
    forms = {'formula': [], 'decimals': words, 'exact': [*words, '--symbolic']}
    return case.explain('--latex', *forms[form])


@in_each_form
@one_chain_of_each_kind
def test_latex_is_complete(case, form):
    document = latex(case, form)
    assert document.startswith(r'\documentclass')
    assert document.rstrip().endswith(r'\end{document}')
    assert f'{len(case.chain.rows()) - 1}}}' in document
    matrices = re.findall(r'\\begin\{bmatrix\}(.*?)\\end\{bmatrix\}', document)
    assert len(matrices) > 5 * len(case.chain.rows())
    for matrix in matrices:
        assert [row.count('&') for row in matrix.split(r'\\')] == [3, 3, 3, 3]


@in_each_form
@one_chain_of_each_kind
def test_latex_is_balanced(case, form):
    document = latex(case, form)
    is_open = ['']
    for kind, name in re.findall(r'\\(begin|end)\{([a-z]+)\}', document):
        if kind == 'begin':
            is_open.append(name)
        else:
            assert is_open.pop() == name
    assert is_open == ['']
    bare = re.sub(r'\\[\\{}$&%#_]', '', document)
    depths = np.cumsum([(letter == '{') - (letter == '}') for letter in bare])
    assert depths.min() == depths[-1] == 0
    assert bare.count('$') % 2 == 0
    outside = re.sub(r'\$[^$]*\$|\\\[.*?\\\]|\\\^\{\}', '', bare)
    assert not {'_', '^'} & {*outside}


@pytest.mark.skipif(not shutil.which('pdflatex'), reason='pdflatex is not installed')
def test_latex_takes_the_documents_and_no_line_is_too_long(tmp_path):
    begin, end = r'\begin{document}', r'\end{document}'
    bodies = []
    for case, form in product(OF_EACH_KIND, FORMS):
        head, _, body = latex(case, form).partition(begin)
        bodies.append(body.partition(end)[0])
    (tmp_path / 'e.tex').write_text(f'{head}{begin}{"".join(bodies)}{end}')
    done = subprocess.run(
        ['pdflatex', '-draftmode', '-interaction=nonstopmode', 'e.tex'],
        cwd=tmp_path,
        capture_output=True,
        timeout=60,
    )
    assert done.returncode == 0
    assert 'Overfull' not in (tmp_path / 'e.log').read_text(encoding='latin-1')


def test_minus_signs_and_spaces_in_latex():
    document = HEAD.explain('--latex', '--degrees', 0, 0, 0, -30, 0, 0)
    assert r'= (-0.5,\ 0,\ 0.866)' in document
    assert r'neck\_pitch $-$30 deg' in document
    assert (
        r'R_{z}(\theta _{0})\,t_{z}(d_{0})\,t_{x}(a_{0})\,R_{x}(\alpha _{0})'
        in document
    )
