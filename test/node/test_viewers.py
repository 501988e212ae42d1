"""The layouts of the viewers: keys that Lichtblick reads, and topics that the node has."""

import json
from pathlib import Path
import re

CONFIG = Path(__file__).resolve().parents[2] / 'config'
TOPICS = {f'/foot_pose_publisher/{name}'
          for name in ('left_foot/pose', 'right_foot/pose', 'skeleton')}
# Keys that Lichtblick's public source reads, under packages/suite-base/src: PlotConfig in
# panels/Plot/utils/config.ts, RendererConfig in panels/ThreeDeeRender/IRenderer.ts, those of
# panels/DiagnosticSummary, and PANEL_TITLE_CONFIG_KEY in util/layout.ts. Foxglove's own is the
# other title.
TITLES = {'lichtblickPanelTitle', 'foxglovePanelTitle'}
KEYS = {
    'Plot': {'paths', 'isSynced', 'xAxisVal', 'showXAxisLabels', 'showYAxisLabels', 'showLegend',
             'legendDisplay'},
    '3D': {'followTf', 'followMode', 'scene', 'cameraState', 'topics', 'layers', 'transforms',
           'publish', 'imageMode'},
    'DiagnosticSummary': {'topicToRender', 'minLevel', 'pinnedIds', 'hardwareIdFilter',
                          'sortByLevel'},
}


def layout() -> dict:
    return json.loads((CONFIG / 'foot_poses_foxglove.json').read_text())


def test_every_panel_has_keys_that_are_read_and_a_title() -> None:
    for name, config in layout()['configById'].items():
        assert set(config) <= KEYS[name.partition('!')[0]] | TITLES, name
        assert config['foxglovePanelTitle'] == config['lichtblickPanelTitle'] != ''


def test_every_panel_of_the_layout_is_there_once() -> None:
    shown = re.findall(r'"(?:first|second)": "([^"]+)"', json.dumps(layout()['layout']))
    assert sorted(shown) == sorted(layout()['configById'])


def test_the_topics_are_those_of_the_node() -> None:
    text = json.dumps(layout())
    assert set(re.findall(r'/foot_pose_publisher/[a-z_]+(?:/pose)?', text)) == TOPICS
    rviz = (CONFIG / 'foot_poses.rviz').read_text()
    assert set(re.findall(r'Value: (/foot_pose_publisher/.*)', rviz)) == TOPICS


def test_rviz_draws_the_axes_of_a_foot_once() -> None:
    rviz = (CONFIG / 'foot_poses.rviz').read_text()
    tf = rviz[rviz.index('rviz_default_plugins/TF'):]
    assert re.search(r'Enabled: (.*)', tf)[1] == 'false'
    assert rviz.count('Shape: Axes') == 2
