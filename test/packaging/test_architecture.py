"""The rooms of the package: who may import whom."""

import ast
from pathlib import Path
import subprocess
import sys

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / 'icub_leg_fk'
MODULES = sorted(PACKAGE.rglob('*.py'))


def imported(file: Path) -> set[str]:
    """Return the modules that a file imports anywhere, by their full names."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = file.relative_to(PACKAGE.parent).parts
            base = '.'.join(parts[:-node.level]) if node.level else ''
            module = '.'.join(filter(None, (base, node.module)))
            names |= {module} | {f'{module}.{alias.name}' for alias in node.names}
    return names


def room(name: str) -> list[Path]:
    return sorted((PACKAGE / name).rglob('*.py'))


def test_the_package_has_its_rooms() -> None:
    assert len(room('kinematics')) > 5
    assert len(MODULES) > len(room('kinematics'))


@pytest.mark.parametrize('file', room('kinematics'), ids=lambda f: f.name)
def test_kinematics_imports_only_numpy_yaml_and_itself(file: Path) -> None:
    allowed = {*sys.stdlib_module_names, 'numpy', 'yaml'}
    for name in imported(file):
        ours = name.startswith(('icub_leg_fk.kinematics', 'icub_leg_fk.errors'))
        assert ours or name.split('.')[0] in allowed, f'{file.name} imports {name}'


@pytest.mark.parametrize('file', room('node'), ids=lambda f: f.name)
def test_ros_never_imports_tools(file: Path) -> None:
    for name in imported(file):
        assert not name.startswith('icub_leg_fk.tools'), f'{file.name} imports {name}'


def test_importing_kinematics_loads_no_ros() -> None:
    code = ('import sys, icub_leg_fk.kinematics; '
            'print([m for m in sys.modules if m.split(".")[0] in ("rclpy", "sensor_msgs") '
            'or m.startswith(("icub_leg_fk.node", "icub_leg_fk.tools"))])')
    result = subprocess.run([sys.executable, '-c', code], cwd=PACKAGE.parent, check=True,
                            capture_output=True, text=True)
    assert result.stdout.strip() == '[]'
