"""The layouts of the viewers: keys that Lichtblick reads, and topics and colours of the node."""

import json
from pathlib import Path
import re

from builtin_interfaces.msg import Time
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.node.skeleton import skeleton_markers
from icub_leg_fk.stream.colors import color_of
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.tools.rviz_config import rviz_config
import pytest
import yaml

CONFIG = Path(__file__).resolve().parents[2] / 'config'
TOPICS = {
    f'/foot_pose_publisher/{name}'
    for name in ('left_foot/pose', 'right_foot/pose', 'skeleton')
}
# Keys that Lichtblick's public source reads, under packages/suite-base/src: PlotConfig in
# panels/Plot/utils/config.ts, RendererConfig in panels/ThreeDeeRender/IRenderer.ts, those of
# panels/DiagnosticSummary, and PANEL_TITLE_CONFIG_KEY in util/layout.ts. Foxglove's own is the
# other title.
TITLES = {'lichtblickPanelTitle', 'foxglovePanelTitle'}
KEYS = {
    'Plot': 'paths isSynced xAxisVal showXAxisLabels showYAxisLabels showLegend '
    'legendDisplay',
    '3D': 'followTf followMode scene cameraState topics layers transforms publish '
    'imageMode',
    'DiagnosticSummary': 'topicToRender minLevel pinnedIds hardwareIdFilter '
    'sortByLevel',
}


@pytest.fixture(scope='module')
def layout():
    return json.loads((CONFIG / 'foot_poses_foxglove.json').read_text())


def rviz(configuration, node='/foot_pose_publisher', root_frame=''):
    text = rviz_config(configuration, node, root_frame)
    return yaml.safe_load(text)['Visualization Manager']


def test_every_panel_has_keys_that_are_read_and_a_title(layout):
    for name, config in layout['configById'].items():
        assert set(config) <= {*KEYS[name.partition('!')[0]].split(), *TITLES}, name
        assert config['foxglovePanelTitle'] == config['lichtblickPanelTitle'] != ''


def test_every_panel_of_the_layout_is_there_once(layout):
    shown = re.findall(r'"(?:first|second)": "([^"]+)"', json.dumps(layout['layout']))
    assert sorted(shown) == sorted(layout['configById'])


def test_the_topics_of_the_layout_are_those_of_the_node(layout):
    text = json.dumps(layout)
    assert set(re.findall(r'/foot_pose_publisher/[a-z_]+(?:/pose)?', text)) == TOPICS


def test_left_and_right_have_a_colour_each_and_their_names_in_every_viewer(layout):
    lines = layout['configById']['Plot!height']['paths']
    for chain, line in zip(
        Configuration.checked(Catalog.load()).chains, lines, strict=True
    ):
        assert f'/{chain.tip}/' in line['value']
        assert line['color'] == color_of(chain)
        markers = skeleton_markers(chain, [0.0] * 6, Time(), '').markers
        bones, name = markers[0], markers[2]
        rgb = bytes.fromhex(line['color'][1:])
        assert (bones.color.r, bones.color.g, bones.color.b) == tuple(
            c / 255 for c in rgb
        )
        assert name.text == chain.tip


def test_the_shipped_rviz_configuration_is_that_of_the_defaults():
    shipped = yaml.safe_load((CONFIG / 'foot_poses.rviz').read_text())[
        'Visualization Manager'
    ]
    assert shipped == rviz(Configuration.checked(Catalog.load()))


def test_rviz_subscribes_best_effort_and_draws_the_axes_of_a_foot_once():
    displays = rviz(Configuration.checked(Catalog.load()))['Displays']
    topics = [display['Topic'] for display in displays if 'Topic' in display]
    assert {topic['Value'] for topic in topics} == TOPICS
    assert {topic['Reliability Policy'] for topic in topics} == {'Best Effort'}
    assert [display['Enabled'] for display in displays if display['Name'] == 'TF'] == [
        False
    ]


def test_rviz_shows_a_robot_of_any_size_in_its_namespace_and_frames():
    catalog = Catalog.load(CONFIG / 'examples/panda.yaml')
    configuration = Configuration.checked(catalog, chains=['panda'], frame_prefix='a/')
    manager = rviz(configuration, '/lab/feet')
    pose = manager['Displays'][-1]
    assert (pose['Name'], pose['Topic']['Value']) == ('flange', '/lab/feet/flange/pose')
    assert manager['Global Options']['Fixed Frame'] == 'a/panda_link0'
    view = manager['Views']['Current']
    assert 1.0 < view['Distance'] < 3.0  # m, for an arm of 1 m
    assert view['Focal Point']['Z'] > 0.3
    assert pose['Axes Length'] > 0.1 * view['Distance']


def test_rviz_looks_for_the_tips_of_a_description_that_is_to_come():
    awaited = Configuration.checked(
        None, chains=['left_leg', 'sole link'], frame_prefix='a/'
    )
    manager = rviz(awaited, '/lab/feet', 'base')
    assert [display['Name'] for display in manager['Displays'][-2:]] == [
        'left_foot',
        'sole_link',
    ]
    assert manager['Displays'][-1]['Topic']['Value'] == '/lab/feet/sole_link/pose'
    assert manager['Global Options']['Fixed Frame'] == 'a/base'
