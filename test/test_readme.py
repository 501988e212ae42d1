"""What the README shows is what happens."""

from pathlib import Path
import re
import shlex
import subprocess
import sys

from icub_leg_fk.tools import leg_fk
import pytest
import yaml

ROOT = Path(__file__).parents[1]
README = (ROOT / 'README.md').read_text()


def blocks(kind: str) -> list[str]:
    return re.findall(rf'^```{kind}\n(.*?)^```', README, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize('block', [b for b in blocks('text') if b.startswith('$ leg_fk explain')])
def test_every_line_of_an_explanation_is_printed_in_this_order(block, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    command, *shown = block.splitlines()
    assert leg_fk.main(shlex.split(command)[2:]) == 0
    printed = iter(line.rstrip() for line in capsys.readouterr().out.splitlines())
    for line in shown:
        if line.strip() not in ('...', ''):
            assert line in printed


def test_the_library_example_runs():
    (block,) = blocks('python')
    names = {}
    exec(block, names)
    assert names['T_root_sole'][:3, 3].tolist() == pytest.approx(list(names['leg'].pose(
        names['q'])[:3]))
    assert names['J'].shape == (6, 6)
    assert names['poses'].shape == (1000, 7)


def test_the_kinematics_file_shown_is_the_shipped_example():
    (block,) = blocks('yaml')
    assert block.rstrip() == (ROOT / 'config/examples/ur5.yaml').read_text().rstrip()


def test_the_commands_that_need_no_other_file_work(monkeypatch, tmp_path):
    commands = [line[2:] for block in blocks('console') for line in block.splitlines()
                if re.match(r'\$ leg_fk (list|pose|explain|urdf)', line)]
    assert len(commands) >= 5
    for command in commands:
        arguments = [str(ROOT / word) if word.startswith('config/') else word
                     for word in shlex.split(command)[1:]]
        subprocess.run([sys.executable, '-m', 'icub_leg_fk.tools.leg_fk', *arguments],
                       cwd=tmp_path, check=True, capture_output=True)


def parameters() -> dict[str, object]:
    (section,) = yaml.safe_load((ROOT / 'config/foot_pose_publisher.yaml').read_text()).values()
    return section['ros__parameters']


@pytest.mark.parametrize('name', [name for name in parameters() if not name.endswith('.version')])
def test_the_table_of_parameters_is_that_of_the_shipped_file(name):
    row = re.search(rf'^\| `{name}` \| `([^`]*)` \|', README, re.MULTILINE)
    assert row, f'{name} is not in the table'
    default = parameters()[name]
    assert yaml.safe_load(row.group(1)) == default


def test_the_pictures_exist_and_links_lead_somewhere():
    headings = {re.sub(r'[^a-z0-9 -]', '', line.lstrip('# ').lower()).replace(' ', '-')
                for line in README.splitlines() if line.startswith('#')}
    for target in re.findall(r'\]\(([^)]+)\)', README):
        if target.startswith('#'):
            assert target[1:] in headings, target
        elif '://' not in target:
            assert (ROOT / target).is_file(), target
