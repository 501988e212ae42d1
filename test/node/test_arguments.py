"""What the command line and the parameter files say, read without rclpy."""

from icub_leg_fk.errors import InputFileError, LegFKError
from icub_leg_fk.node.arguments import (
    check_assignments,
    files_for_others,
    names_given,
    parameters_for,
    read_arguments,
)
import pytest

NODE = '/icub/foot_pose_publisher'
NAMES = ('version', 'chains', 'foot_frame')


def read(line):
    return read_arguments(['program', *line.split()])


@pytest.mark.parametrize(
    ('line', 'meant'),
    [
        ('version:=v1', '--ros-args -p version:=v1'),
        ('version:=v1 --ros-args -p foot_frame:=sole', '--ros-args -p version:=v1'),
        ('--ros-args -p foot_frame:=sole version:=v1', '--ros-args -p version:=v1'),
        ('--ros-args -p foot_frame:=sole -- _version:=v1', '--ros-args -p version:=v1'),
        ('verson:=v1', '--ros-args -p version:=v1'),
        ('joint_states:=/x', '--ros-args -r joint_states:=/x'),
        ('__node:=x', '--ros-args -r __node:=x'),
        ('--ros-args -p version=v1', '-p version:=v1'),
        ('--ros-args --param version', '-p version:=VALUE'),
        ('--ros-args -r version:=v1', '-p version:=v1'),
        (
            '--ros-args --remap foot_pose_publisher:chains:=[left_leg]',
            '-p chains:=[left_leg]',
        ),
    ],
)
def test_what_leads_nowhere_is_refused_with_the_way_to_write_it(line, meant):
    with pytest.raises(LegFKError) as error:
        check_assignments(read(line), NAMES)
    assert str(error.value).endswith(f'; did you mean {meant}?')


def test_what_is_written_well_passes():
    check_assignments(
        read(
            '--ros-args -p version:=v1 -p node:chains:=[a=v1] -r joint_states:=/x '
            '-r __ns:=/icub --log-level rcl:=debug --params-file a:=b -- file'
        ),
        NAMES,
    )


def test_the_names_given_are_those_for_this_node():
    arguments = read(
        'a:=1 --ros-args -p b:=2 --param foot_pose_publisher:c:=3 -p /**:d:=4 '
        '-p /icub/foot_pose_publisher:e:=5 -p other:f:=6 -r g:=7 -- -p h:=8'
    )
    assert names_given(arguments, NODE) == {'b', 'd', 'e'}
    assert names_given(arguments, '/foot_pose_publisher') == {'b', 'c', 'd'}


# What rclpy does with each of these names, tried with rclpy 7.1.
@pytest.mark.parametrize(
    ('place', 'root', 'inside'),
    [
        ('/**', True, True),
        ('**', True, True),
        ('/*', True, False),
        ('/*/*', False, True),
        ('foot_pose_publisher', True, False),
        ('/foot_pose_publisher', True, False),
        ('/**/foot_pose_publisher', True, True),
        ('/*/foot_pose_publisher', False, True),
        ('icub/foot_pose_publisher', False, True),
        ('/icub/**', False, True),
        ('/icub', False, False),
        ('/foot_pose_publisher/**', True, False),
    ],
)
def test_a_place_in_a_file_is_a_name_or_a_pattern(tmp_path, place, root, inside):
    file = tmp_path / 'parameters.yaml'
    file.write_text(f'"{place}": {{ros__parameters: {{version: v1}}}}\n')
    arguments = read(f'--ros-args --params-file {file}')
    for node, is_for in (('/foot_pose_publisher', root), (NODE, inside)):
        assert parameters_for(str(file), node) == ({'version': 'v1'} if is_for else {})
        assert bool(files_for_others(arguments, node)) is not is_for


def test_places_can_be_nested_and_the_last_value_counts(tmp_path):
    file = tmp_path / 'parameters.yaml'
    file.write_text(
        '/**: {ros__parameters: {version: v1, foot_frame: sole}}\n'
        'icub: {foot_pose_publisher: {ros__parameters: {version: v3}}}\n'
    )
    assert parameters_for(str(file), NODE) == {'version': 'v3', 'foot_frame': 'sole'}


def test_a_file_for_others_is_reported_with_whom_it_is_for(tmp_path):
    file = tmp_path / 'parameters.yaml'
    file.write_text('/other/foot_pose_publisher: {ros__parameters: {version: v1}}\n')
    assert files_for_others(read(f'--ros-args --params-file {file}'), NODE) == [
        f'nothing was taken from {file}: it is for /other/foot_pose_publisher, and this node is '
        f'{NODE}'
    ]


@pytest.mark.parametrize('content', ['', '[', '\0', '[1, 2]', 'no: node'])
def test_a_file_without_nodes_is_none_for_others(tmp_path, content):
    file = tmp_path / 'parameters.yaml'
    file.write_text(content)
    assert files_for_others(read(f'--ros-args --params-file {file}'), NODE) == []


def test_a_file_that_cannot_be_read_is_named():
    with pytest.raises(InputFileError, match=r'^/no/such\.yaml: '):
        parameters_for('/no/such.yaml', NODE)
