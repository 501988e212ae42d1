"""What a set of values gives, or why it is refused; the node and `leg_fk bag` take the same."""

from pathlib import Path
import re
from tempfile import TemporaryDirectory

from icub_leg_fk.errors import ParameterError
from icub_leg_fk.kinematics import Catalog, Urdf
from icub_leg_fk.stream.configuration import Configuration
import pytest
from support.described_robots import own_description

ARMS = """
units: {length: m, angle: rad}
chains:
  arm:
    tip: hand
    root_frame: base
    joints: [lift]
    tip_frames: {flange: {frame: arm_flange}, tool: {frame: arm_tool}}
    versions: &both
      a: &rows {links: [{type: prismatic, a: 0, d: 0.1, alpha: 0, range: [0, 0.2]}]}
      b: *rows
  crane:
    tip: hook
    root_frame: base
    joints: [lift]
    tip_frames: {hook: {frame: crane_hook}}
    default_version: b
    versions: *both
"""


SHIPPED = Catalog.load()


def arms(text=ARMS):
    with TemporaryDirectory() as folder:
        file = Path(folder) / 'arms.yaml'
        file.write_text(text)
        return Catalog.load(file)


def test_the_defaults_are_those_of_the_node():
    configuration = Configuration.checked(SHIPPED)
    assert (configuration.notes, configuration.warnings) == ((), ())
    assert (configuration.frame_prefix, configuration.joint_timeout) == ('', 0.5)
    assert not configuration.stamp_now
    assert not (
        configuration.publish_tf
        or configuration.publish_twist
        or configuration.publish_markers
    )


@pytest.mark.parametrize(
    ('values', 'expected'),
    [
        ({}, 'left_leg=v2_5 l_foot_dh_frame, right_leg=v2_5 r_foot_dh_frame'),
        (
            {'version': 'v1', 'foot_frame': 'sole'},
            'left_leg=v1 l_sole, right_leg=v1 r_sole',
        ),
        (
            {'chains': ['left_leg=v1', 'right_leg'], 'foot_frame': 'sole'},
            'left_leg=v1 l_sole, right_leg=v2_5 r_sole',
        ),
        (
            {'chains': ['right_leg=v2_5', 'left_leg'], 'version': 'v1'},
            'right_leg=v2_5 r_foot_dh_frame, left_leg=v1 l_foot_dh_frame',
        ),
        (
            {'chains': ['left_leg', 'head_imu=v2'], 'version': 'v1'},
            'left_leg=v1 l_foot_dh_frame, head_imu=v2 imu_frame',
        ),
        (
            {'chains': ['head_imu'], 'foot_frame': 'sole', 'frame_prefix': 'icub1/'},
            'head_imu=v2 imu_frame; '
            'head_imu has no sole frame; its pose is that of icub1/imu_frame',
        ),
        ({'chains': ['arm=a'], 'foot_frame': 'tool'}, 'arm=a arm_tool'),
        (
            {'chains': ['crane'], 'foot_frame': 'tool'},
            'crane=b crane_hook; '
            'crane has no tool frame; its pose is that of crane_hook',
        ),
        (
            {'chains': ['arm=b', 'crane=a']},
            'arm=b arm_flange, crane=a crane_hook; '
            'arm has no dh frame; its pose is that of arm_flange; '
            'crane has no dh frame; its pose is that of crane_hook',
        ),
    ],
    ids=str,
)
def test_chains_have_a_version_and_a_frame_which_is_said_where_it_is_another(
    values, expected
):
    is_of_icub = '_' in values.get('chains', ['left_leg'])[0]
    configuration = Configuration.checked(SHIPPED if is_of_icub else arms(), **values)
    chains = configuration.chains
    words = [f'{chain.name}={chain.version} {chain.frame_id}' for chain in chains]
    assert '; '.join([', '.join(words), *configuration.notes]) == expected


@pytest.mark.parametrize(
    ('values', 'refused'),
    [
        (
            {'version': 'v9'},
            "version: unknown version 'v9' of chain left_leg; known: v1, v2_5, v3",
        ),
        ({'version': 'V1'}, "version: unknown version 'V1' of chain left_leg"),
        ({'chains': ['left_leg', 'head_imu'], 'version': 'v1'}, 'as in head_imu=v'),
        ({'chains': ['left_leg=v7']}, "chains: unknown version 'v7' of chain left_leg"),
        (
            {'chains': ['lef_leg']},
            "chains: unknown chain 'lef_leg'; did you mean 'left_leg'?",
        ),
        (
            {'chains': []},
            'chains: no chain is named; allowed: one or more of left_leg, right_leg',
        ),
        (
            {'chains': ['left_leg', 'left_leg=v1']},
            'chains: chain left_leg is named twice',
        ),
        (
            {'chains': ['left_leg=v3', 'right_leg']},
            'chains: left_leg=v3 and right_leg=v2_5 do not go',
        ),
        ({'foot_frame': 'toe'}, "foot_frame: found 'toe', allowed: dh or sole"),
        (
            {'joint_prefix': 'a\nb'},
            r"joint_prefix: found 'a\\nb', allowed: printable characters",
        ),
        ({'frame_prefix': 'a b'}, "frame_prefix: found 'a b', allowed: printable"),
        (
            {'frame_prefix': '/icub1/'},
            "frame_prefix: found '/icub1/', allowed: .* no leading slash",
        ),
        ({'joint_timeout': -0.1}, 'joint_timeout: found -0.1, allowed: 0 to 1e'),
        ({'joint_timeout': 1.1e6}, 'joint_timeout: found 1100000.0'),
        ({'joint_timeout': float('nan')}, 'joint_timeout: found nan'),
        ({'joint_timeout': float('inf')}, 'joint_timeout: found inf'),
        (
            {'stamp_source': 'later'},
            "stamp_source: found 'later', allowed: message or now",
        ),
    ],
    ids=str,
)
def test_a_value_that_cannot_be_used_is_refused_with_the_choices(values, refused):
    with pytest.raises(ParameterError, match=f'^parameter .*{refused}') as error:
        Configuration.checked(SHIPPED, **values)
    assert '\n' not in str(error.value)


def test_joints_are_looked_for_under_their_prefix():
    values = {'chains': ['left_leg'], 'joint_prefix': 'icub 1/'}
    [leg] = Configuration.checked(SHIPPED, **values).chains
    bare = SHIPPED.chain('left_leg')
    assert leg.joint_names == tuple(f'icub 1/{name}' for name in bare.joint_names)
    assert leg.pose([0.1] * 6) == bare.pose([0.1] * 6)
    rows = (
        '[{type: prismatic, a: 0, d: 0.1, alpha: 0, joint: lift}, '
        '{type: prismatic, a: 0, d: 0, alpha: 0, joint: lift, gain: 2}]'
    )
    followed = arms(re.sub(r'links: \[.*\]}', f'links: {rows}}}', ARMS))
    values = {'chains': ['arm=a'], 'joint_prefix': 'x'}
    [arm] = Configuration.checked(followed, **values).chains
    assert [row.joint for row in arm.rows()] == ['xlift', 'xlift']


def test_two_chains_with_the_topics_of_one_are_refused():
    text = (
        own_description('v2_5')
        .replace('l_sole', 'sole one')
        .replace('r_sole', 'sole-one')
    )
    catalog = Catalog.from_urdf(Urdf.parse(text.encode(), 'robot.urdf'))
    refused = 'chains sole one and sole-one do not go together: .* sole_one'
    with pytest.raises(ParameterError, match=refused):
        Configuration.checked(catalog, chains=['sole one', 'sole-one'])


def test_without_a_catalog_the_chains_wait_for_a_description():
    configuration = Configuration.checked(None, chains=['l_sole'], version='urdf')
    assert (configuration.chains, configuration.awaited) == ((), ('l_sole',))
    for values, refused in (
        ({'version': 'v3'}, "version: found 'v3', allowed with descr"),
        ({'chains': []}, 'chains: no chain is named'),
        ({'stamp_source': 'later'}, 'stamp_source'),
    ):
        with pytest.raises(ParameterError, match=refused):
            Configuration.checked(None, **values)


def test_a_chain_without_a_default_version_needs_one():
    refused = r'^parameter version: chain arm has .* a, b'
    with pytest.raises(ParameterError, match=refused):
        Configuration.checked(arms(), chains=['arm'])


@pytest.mark.parametrize('seconds', [0.0, 1e6])
def test_the_limits_of_the_timeout_are_allowed(seconds):
    configuration = Configuration.checked(SHIPPED, joint_timeout=seconds)
    assert configuration.joint_timeout == seconds


def test_what_is_doubtful_in_the_file_is_passed_on():
    catalog = arms(ARMS.replace('d: 0.1', 'd: 1000'))
    configuration = Configuration.checked(catalog, chains=['crane'])
    assert any('1000 m is unlikely' in line for line in configuration.warnings)
