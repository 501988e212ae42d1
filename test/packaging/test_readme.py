"""What README and documentation show is what happens."""

import os
from pathlib import Path
import re
import shlex
import subprocess
import sys

from icub_leg_fk import __main__ as leg_fk
import pytest
import yaml

ROOT = Path(__file__).parents[2]
README = (ROOT / 'README.md').read_text()
PAGES = {path.name: path.read_text() for path in (
    ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', ROOT / 'QUALITY_DECLARATION.md',
    *sorted((ROOT / 'docs').glob('*.md')))}


def blocks(text: str, kind: str) -> list[str]:
    return re.findall(rf'^```{kind}\n(.*?)^```', text, re.DOTALL | re.MULTILINE)


def commands(text: str) -> list[str]:
    """Return the lines of the console blocks, without their prompt."""
    return [line[2:].partition('     #')[0].strip() for block in blocks(text, 'console')
            for line in block.splitlines() if line.startswith('$ ')]


def test_the_readme_can_be_read_in_ten_minutes():
    assert len(README.split()) <= 1000


EXPLANATIONS = [block for text in PAGES.values() for block in blocks(text, 'text')
                if block.startswith('$ leg_fk explain')]


@pytest.mark.parametrize('block', EXPLANATIONS)
def test_every_line_of_an_explanation_is_printed_in_this_order(block, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    command, *shown = block.splitlines()
    assert leg_fk.main(shlex.split(command)[2:]) == 0
    printed = iter(line.rstrip() for line in capsys.readouterr().out.splitlines())
    for line in shown:
        if line.strip() not in ('...', ''):
            assert line in printed


def test_explanations_are_shown():
    assert len(EXPLANATIONS) == 2


@pytest.mark.parametrize('page', ['README.md', 'api.md'])
def test_the_library_example_runs(page):
    (block,) = blocks(PAGES[page], 'python')
    names = {}
    exec(block, names)
    assert names['T_root_sole'][:3, 3].tolist() == pytest.approx(list(names['leg'].pose(
        names['q'])[:3]))
    assert names['J'].shape == (6, 6)
    assert names['poses'].shape == (1000, 7)


def test_the_kinematics_file_shown_is_the_shipped_example():
    (block,) = blocks(PAGES['kinematics_file.md'], 'yaml')
    assert block.rstrip() == (ROOT / 'config/examples/ur5.yaml').read_text().rstrip()


@pytest.mark.parametrize('page', PAGES)
def test_every_command_has_arguments_that_are_known(page):
    """They are parsed, not run; `ros2 run` in front of them makes no difference."""
    for command in commands(PAGES[page]):
        words = shlex.split(command)
        if 'leg_fk' in words[:4]:
            words = words[words.index('leg_fk') + 1:]
            leg_fk.parse(words)


def parameters() -> dict[str, object]:
    (section,) = yaml.safe_load((ROOT / 'config/foot_pose_publisher.yaml').read_text()).values()
    return section['ros__parameters']


@pytest.mark.parametrize('page', ['README.md', 'node.md'])
@pytest.mark.parametrize('name', [name for name in parameters() if not name.endswith('.version')])
def test_the_tables_of_parameters_are_those_of_the_shipped_file(page, name):
    rows = re.findall(r'^\| (`[^|]*`) \| `([^`]*)` \|', PAGES[page], re.MULTILINE)
    [default] = [default for names, default in rows if f'`{name}`' in names.split(', ')]
    assert yaml.safe_load(default) == parameters()[name]


@pytest.mark.parametrize('page', PAGES)
def test_links_and_pictures_lead_somewhere(page):
    folder = ROOT / 'docs' if (ROOT / 'docs' / page).exists() else ROOT
    for target in re.findall(r'\]\(([^)]+)\)', PAGES[page]):
        if '://' in target:
            continue
        file, _, anchor = target.partition('#')
        assert not file or (folder / file).is_file(), target
        text = (folder / file).read_text() if file.endswith('.md') else PAGES[page]
        anchors = {re.sub(r'[^a-z0-9 _-]', '', line.lstrip('# ').lower()).replace(' ', '-')
                   for line in text.splitlines() if line.startswith('#')}
        assert not anchor or anchor in anchors, target


@pytest.mark.skipif('README_BLOCKS' not in os.environ,
                    reason='sets up a fresh environment, for minutes: make readme')
def test_every_block_of_the_readme_works_in_order_in_a_fresh_clone(tmp_path):
    """As somebody without ROS follows it; what needs ros2 or colcon is told and passed over."""
    subprocess.run(['git', 'clone', '--quiet', ROOT, tmp_path / 'clone'], check=True)
    script, passed_over = ['set -ex'], []
    for command in commands(README):
        if shlex.split(command)[0] in ('ros2', 'rosdep', 'colcon') or 'install/setup' in command:
            passed_over.append(command)
        else:
            script.append(command)
    (example,) = blocks(README, 'python')
    (tmp_path / 'clone' / 'example.py').write_text(example)
    script.append('python example.py')
    print('passed over:', *passed_over, sep='\n  ')
    environment = {name: value for name, value in os.environ.items()
                   if name in ('PATH', 'HOME', 'LANG', 'ROS_DOMAIN_ID') or name.startswith('PIP_')}
    done = subprocess.run(['bash', '-c', '\n'.join(script)], cwd=tmp_path / 'clone',
                          env=environment, stdout=sys.stdout, stderr=sys.stderr, check=False)
    assert done.returncode == 0
    made = {path.name for path in (tmp_path / 'clone').iterdir()}
    assert {'walk', 'walk_with_poses', 'feet.png', 'robot.urdf', 'my_robot.yaml'} <= made
