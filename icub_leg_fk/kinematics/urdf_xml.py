"""From the text of a URDF to its XML elements, as forgivingly as robot_state_publisher reads it.

Its parser, urdfdom, knows no namespaces and no entities, looks into neither comments nor the XML
declaration, and takes text for UTF-8. What it forgives is taken out or escaped before lxml reads
the rest; lxml goes on after an error, and of its errors only those that urdfdom cannot see are
forgiven. Every other is refused, since what lxml makes of it is a guess.
"""

from __future__ import annotations

from codecs import BOM_UTF16_BE, BOM_UTF16_LE
import re
from typing import NoReturn

from icub_leg_fk.errors import InputFileError
from lxml import etree
import yaml

REPLACEMENT = '\N{REPLACEMENT CHARACTER}'
"""What stands where a byte is not UTF-8 text; a name that has it cannot be used."""

_OLD_XACRO = ('include', 'macro', 'property')  # before ROS Jade they had no prefix
_CUT_OFF = 140  # characters; `ros2 topic echo` prints 128 of a text, and three points

_ECHOED = re.compile(rb'(?:^|\n)data: *(?:["\']|[|>][-+0-9]*\s*)?$')
_DECLARATIONS = re.compile(r'\s*(?:<\?.*?\?>\s*)+', re.DOTALL)
_COMMENT = re.compile(r'<!--.*?-->', re.DOTALL)
_VALUE = re.compile(r'(=\s*)("[^"<]*"|\'[^\'<]*\')')
_BARE_AMPERSAND = re.compile(r'&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9A-Fa-f]+);)')
_NO_TEXT = re.compile('[\x01-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]')


def robot_element(data: bytes, file: str) -> etree._Element:
    """Return the root element of a URDF.

    Args:
        data: the URDF, maybe as `ros2 topic echo` or `ros2 param get` prints it.
        file: what it is called in an error.

    Raises:
        InputFileError: it is not a URDF, or its XML is malformed in a way that is not forgiven.
    """
    text = _text(data, file)
    parser = etree.XMLParser(
        recover=True,
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        robot = etree.fromstring(text.encode(), parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise InputFileError(file, f'is not XML: {_one_line(str(error))}') from None
    for entry in parser.error_log:
        if entry.level >= etree.ErrorLevels.ERROR and entry.domain_name != 'NAMESPACE':
            _refuse(file, entry.line, entry.message)
    _refuse_other_formats(robot, file)
    return robot


def tag(element: etree._Element) -> str:
    """Return the name of an element; a default namespace counts for nothing."""
    name = str(element.tag).rpartition('}')[2]
    return f'{element.prefix}:{name}' if element.prefix else name


def _text(data: bytes, file: str) -> str:
    """Return the XML with what is forgiven taken out; its lines keep their numbers."""
    start = data.find(b'<')
    if start < 0:
        _refuse_without_element(data, file)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        raise InputFileError(file, 'is not XML: it is UTF-16 text; allowed: UTF-8')
    echoed = _ECHOED.search(data[:start])
    if echoed:  # what stands before it may be a warning, such as of a lost message
        first = echoed.start()
        text = _echoed(data[first:], file)
    else:
        newlines = '\n' * data.count(b'\n', 0, start)
        text = newlines + data[start:].decode('utf-8', 'replace')
    text = _without_what_follows(text.replace('\r\n', '\n').replace('\r', '\n'))
    _refuse_mark(text, '\0', 'a zero byte', file)
    text = _COMMENT.sub(lambda found: f'<!--{_newlines(found)}-->', text)
    declarations = _DECLARATIONS.match(text)
    if declarations:
        end = declarations.end()
        text = _newlines(declarations) + text[end:]
    _refuse_mark(text, '<?', 'a processing instruction', file)
    text = _NO_TEXT.sub(REPLACEMENT, text)
    text = _VALUE.sub(_with_its_newlines, text)
    return _BARE_AMPERSAND.sub('&amp;', text)


def _refuse_without_element(data: bytes, file: str) -> NoReturn:
    if not data.strip():
        raise InputFileError(file, 'is not XML: it is empty')
    if b'chains:' in data:
        raise InputFileError(file, 'is a kinematics file; allowed here: a URDF')
    raise InputFileError(file, 'is not XML: it has no element')


def _without_what_follows(text: str) -> str:
    """Return a document without the text after its end, such as the --- of `ros2 topic echo`."""
    last = text.rfind('</robot>')
    end = last + len('</robot>')
    return text if last < 0 or '<' in text[end:] else text[:end]


def _with_its_newlines(found: re.Match[str]) -> str:
    """Return an attribute's value that XML would read with blanks instead, and its lines after."""
    value = found[2].replace('\n', '&#10;').replace('\t', '&#9;')
    return f'{found[1]}{value}{_newlines(found)}'


def _newlines(found: re.Match[str]) -> str:
    return '\n' * found[0].count('\n')


def _echoed(data: bytes, file: str) -> str:
    """Return the text of a message that `ros2 topic echo` has printed as YAML."""
    try:
        documents = yaml.load_all(
            data, Loader=getattr(yaml, 'CBaseLoader', yaml.BaseLoader)
        )
        text = next(documents)['data']
    except (yaml.YAMLError, KeyError, TypeError):
        raise InputFileError(
            file, 'is not a URDF, nor one that ros2 topic echo prints'
        ) from None
    if len(text) < _CUT_OFF and text.endswith('...'):
        raise InputFileError(
            file,
            'is cut off; this prints all of it: ros2 topic echo --once '
            '--full-length /robot_description',
        )
    return str(text)


def _refuse_other_formats(robot: etree._Element, file: str) -> None:
    for element in robot.iter(etree.Element):
        is_old = element.getparent() is robot and tag(element) in _OLD_XACRO
        if is_old or tag(element).startswith('xacro:'):
            raise InputFileError(
                file,
                f'is a xacro file; this makes a URDF of it: xacro {file} > robot.urdf',
            )
    if tag(robot) != 'robot':
        raise InputFileError(
            file, f'is not a URDF: its root is <{tag(robot)[:60]}>; allowed: <robot>'
        )


def _refuse_mark(text: str, mark: str, name: str, file: str) -> None:
    if mark in text:
        _refuse(
            file, text.count('\n', 0, text.index(mark)) + 1, f'{name} in the document'
        )


def _refuse(file: str, line: int, fault: str) -> NoReturn:
    raise InputFileError(file, f'is not XML: line {line}: {_one_line(fault)}')


def _one_line(text: str) -> str:
    return ' '.join(text.split())[:200]
