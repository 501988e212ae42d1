"""XML as robot_state_publisher reads it: what it forgives is read as it does, or refused."""

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Catalog, Urdf
import pytest
from support.robots import joint, robot
import yaml

PLAIN = robot([joint(0), joint(1, xyz='0.3 0 0')])
END = '</robot>'

FORGIVEN = {
    'default namespace': PLAIN.replace('<robot', '<robot xmlns="http://www.ros.org"'),
    'undeclared prefix': PLAIN.replace(
        END, '<gazebo><s:camera n:x="1"/></gazebo></robot>'
    ),
    'dashes in a comment': PLAIN.replace(END, '<!-- a -- b ---></robot>'),
    'bytes in a comment': PLAIN.replace(END, '<!-- in \udcb0 \x01 --></robot>'),
    'blanks before the declaration': f' \n<?xml version="1.0"?>\n{PLAIN}',
    'unquoted version': f'<?xml version=1.0?>{PLAIN}',
    'encoding that is not': f'<?xml version="1.0" encoding="utf-61"?>{PLAIN}',
    'byte order mark': f'\ufeff{PLAIN}',
    'bare ampersand': PLAIN.replace(
        END, '<plugin name="a & b">&c; && d</plugin></robot>'
    ),
    'document type': f'<!DOCTYPE robot [<!ENTITY e "x">]>{PLAIN}',
    'document type elsewhere': f'<!DOCTYPE robot SYSTEM "file:///etc/passwd">{PLAIN}',
    'carriage returns': PLAIN.replace('><', '>\r\n<'),
    'cdata': PLAIN.replace(END, '<p><![CDATA[a < b & c]]></p></robot>'),
    'text between': PLAIN.replace(END, f'some text{END}'),
    'comment after the end': f'{PLAIN}<!-- end -->',
}
NAMES = [
    'l & 1',
    'l&amp;1',
    'l&x;1',
    'l\n1',
    ' l\t1',
    'l &lt; 1',
    'gelenk_ö',
    'l&#49;',
    "l'1",
    'l 1 [x]',
    'l::1',
]
REFUSED = {
    'wrong end tag': (
        PLAIN.replace('</joint>', '</joynt>', 1),
        'line 1: Opening and ending tag',
    ),
    'missing end': (PLAIN.replace(END, ''), 'line 1: Premature end of data'),
    'cut off': (PLAIN[:150], 'is not XML: line 1'),
    'two robots': (PLAIN + PLAIN, 'Extra content at the end'),
    'less than': (
        PLAIN.replace(END, '\n<p n="a < b"/></robot>'),
        "line 2: Unescaped '<'",
    ),
    'unquoted value': (PLAIN.replace(END, '<p n=1/></robot>'), 'is not XML'),
    'attribute twice': (
        PLAIN.replace(END, '<p n="1" n="2"/></robot>'),
        'Attribute n redefined',
    ),
    'zero byte': (PLAIN.replace(END, '\n\n<p n="\0"/></robot>'), 'line 3: a zero byte'),
    'instruction': (
        PLAIN.replace(END, '<?php x ?></robot>'),
        'a processing instruction',
    ),
    'open comment': (PLAIN.replace(END, '<!-- x</robot>'), 'Comment not terminated'),
    'character 0': (
        PLAIN.replace(END, '<p n="&#0;"/></robot>'),
        'invalid xmlChar value 0',
    ),
    'too deep': (
        PLAIN.replace(END, '<p>' * 300 + '</p>' * 300 + END),
        'Excessive depth',
    ),
    'too much': (
        PLAIN.replace(END, f'<p n="{"x" * 11_000_000}"/></robot>'),
        'limit exceeded',
    ),
    'no element': ('left_leg', 'it has no element'),
    'nothing': (' \n', 'it is empty'),
    'UTF-16': ('\udcff\udcfe<\0r\0>\0', 'it is UTF-16 text; allowed: UTF-8'),
    'entities of entities': (
        '<!DOCTYPE r [<!ENTITY e0 "x">'
        + ''.join(f'<!ENTITY e{i} "&e{i - 1};&e{i - 1};">' for i in range(1, 60))
        + ']><robot>&e59;',
        'is not XML',
    ),
}


def parse(text):
    return Urdf.parse(text.encode('utf-8', 'surrogateescape'), 'robot.urdf')


def pinocchio_links(text):
    pin = pytest.importorskip('pinocchio')
    model = pin.buildModelFromXML(text)
    return [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY]


@pytest.mark.parametrize('kind', FORGIVEN)
def test_what_urdfdom_forgives_is_read_as_it_is_meant(kind):
    assert parse(FORGIVEN[kind]) == parse(PLAIN)
    if '\udcb0' not in FORGIVEN[kind]:  # which Python's binding cannot take
        assert pinocchio_links(FORGIVEN[kind].lstrip('\ufeff')) == ['l0', 'l1', 'l2']


@pytest.mark.parametrize('name', NAMES)
def test_names_are_those_that_pinocchio_reads(name):
    text = PLAIN.replace('"l1"', f'"{name}"')
    assert [*parse(text).links] == pinocchio_links(text)


@pytest.mark.parametrize('kind', REFUSED)
def test_what_lxml_would_have_to_guess_is_refused_with_its_line(kind):
    text, words = REFUSED[kind]
    with pytest.raises(InputFileError) as refusal:
        parse(text)
    assert words in str(refusal.value) and str(refusal.value).isprintable()
    assert str(refusal.value).startswith('robot.urdf: is not XML: ')


@pytest.mark.parametrize(
    'around',
    [
        'String value is: {}\n',
        '{}\n---\n',
        'data: {}\n---\n',
        'A message was lost!!!\n\ttotal count change:1\ndata: {}\n---\n',
    ],
)
def test_what_ros_2_prints_of_a_description_is_read(around, written):
    text = PLAIN.replace('><', '>\n  <')
    shown = (
        yaml.safe_dump(text, width=10**6).rstrip('.\n') if 'data' in around else text
    )
    assert parse(around.format(shown)) == parse(PLAIN)
    file = written(around.format(shown))
    assert Catalog.load(file).chain('l2').version == 'urdf'


def test_a_description_that_ros_2_has_cut_off_is_refused_with_the_way(written):
    for start in ('', '<?xml version="1.0" ?>\n<!-- ' + 'made by xacro ' * 20 + '-->'):
        shown = yaml.safe_dump((start + PLAIN)[:128] + '...')
        file = written(f'data: {shown}---\n')
        with pytest.raises(
            InputFileError, match=r'is cut off; .* --full-length /robot_descr'
        ):
            Catalog.load(file)
    file.write_text('data: "<robot\n')
    with pytest.raises(InputFileError, match='is not a URDF, nor one that'):
        Catalog.load(file)
