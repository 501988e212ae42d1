"""Points 1 to 4 and 7: the node beside its references, all at 1 kHz with 32 joints and two feet.

Nodes run side by side and get their messages in turns, so that whatever else the machine does
meets all of them; every ratio is of two stretches that followed one another.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import closing, ExitStack
from typing import NamedTuple

from bench.measure import difference, figure, percentile, ratio
from bench.node_process import Bench, NodeProcess, POSES, Stretch, TWISTS
from bench.report import Report

_JOINTS = 32
_RATE = 1000.0  # Hz
_COMPARED = ('floor', 'ours', 'plain')
_MORE = ('ours', 'twists', 'extras', 'unwatched', 'decode', 'send', 'receive', 'dds', 'bare')
_EXTRAS = ('publish_twist:=true', 'publish_markers:=true')
_RATES = (100.0, 300.0, 1000.0, 2000.0, 3000.0, 4500.0, 7000.0, 10000.0, 14000.0)  # Hz
_RAMP = 1.25
_BEHIND = 50_000.0  # us; a last pose so late tells that the node does not keep up
_FASTEST = 60000.0  # Hz


class Effort(NamedTuple):
    """How much is measured.

    Attributes:
        rounds: turns of each node; twice as many of those that are compared.
        messages: messages in a turn.
        starts: starts of each node.
        points: whether all points of the growth curves are measured.
    """

    rounds: int
    messages: int
    starts: int
    points: bool


Turns = dict[str, list[Stretch]]


def measure_node(report: Report, effort: Effort) -> None:
    """Add the rows of points 1 to 4 and 7, the bill and the growth with the load."""
    with closing(Bench()) as bench:
        _measure_side_by_side(report, bench, effort)
        _measure_saturation(report, bench, effort)
        _measure_starts(report, bench, effort)
        _measure_growth(report, bench, effort)


def _measure_side_by_side(report: Report, bench: Bench, effort: Effort) -> None:
    with ExitStack() as stack:
        nodes = {name: stack.enter_context(closing(node.start())) for name, node in {
            'floor': NodeProcess('floor', 'floor'),
            'ours': NodeProcess('ours', 'ours'),
            'plain': NodeProcess('plain', 'plain'),
            'twists': NodeProcess('twists', 'ours', (*POSES, *TWISTS), ('publish_twist:=true',)),
            'extras': NodeProcess('extras', 'ours', parameters=_EXTRAS),
            'unwatched': NodeProcess('unwatched', 'ours', outputs=()),
            'decode': NodeProcess('decode', 'decode'),
            'send': NodeProcess('send', 'send'),
            'receive': NodeProcess('receive', 'receive', outputs=()),
            'dds': NodeProcess('dds', 'dds', outputs=()),
            'bare': NodeProcess('bare', 'bare'),
        }.items()}
        _match(bench, nodes.values())
        turns = _take_turns(bench, nodes, _COMPARED, 2 * effort.rounds, effort.messages)
        more = _take_turns(bench, nodes, _MORE, effort.rounds, effort.messages)
        resident = {name: node.resident_bytes() / 1e6 for name, node in nodes.items()}
        for node in nodes.values():
            bench.forget(node)
    cpu, more_cpu = ({name: [turn.cpu for turn in stretches] for name, stretches in taken.items()}
                     for taken in (turns, more))
    p50, p99 = ({name: [percentile(turn.latencies, percent) for turn in turns[name]]
                 for name in _COMPARED} for percent in (50, 99))
    report.section(f'1. CPU per message, two feet, {_RATE:.0f} Hz, {_JOINTS} joints')
    for name in _COMPARED:
        report.row(name, figure(cpu[name]), 'us')
    report.row('ours with two twists beside', figure(more_cpu['twists']), 'us')
    report.row('ours / floor', ratio(cpu['ours'], cpu['floor']), 'x', at_most=1.3)
    report.row('ours / plain', ratio(cpu['ours'], cpu['plain']), 'x', at_most=0.28)
    report.section('2. latency, JointState sent to PoseStamped received')
    for name in _COMPARED:
        report.row(f'{name}, p50', figure(p50[name]), 'us')
        report.row(f'{name}, p99', figure(p99[name]), 'us')
    report.row('p50, ours / floor', ratio(p50['ours'], p50['floor']), 'x', at_most=1.3)
    report.row('p99, ours / plain', ratio(p99['ours'], p99['plain']), 'x', at_most=0.6)
    report.section('4. what nobody subscribes to')
    report.row('twist and skeleton on, unwatched / off', ratio(
        more_cpu['extras'], more_cpu['ours']), 'x', at_most=1.1)
    report.row('no topic watched', figure(more_cpu['unwatched']), 'us')
    report.section('7. memory: resident size')
    report.row('bare rclpy node', figure([resident['bare']]), 'MB')
    report.row('ours', figure([resident['ours']]), 'MB')
    report.row('ours less bare', difference([resident['ours']], [resident['bare']]), 'MB',
               at_most=5.0)
    report.section('the bill of one message')
    for label, step, before in (
            ('middleware receives', 'dds', None), ('executor takes', 'receive', 'dds'),
            ('middleware sends two', 'send', 'receive'), ('input rules', 'decode', 'send'),
            ('kinematics and two messages', 'ours', 'decode')):
        report.row(label, difference(more_cpu[step], more_cpu[before] if before
                                     else [0.0] * effort.rounds), 'us')


def _take_turns(bench: Bench, nodes: dict[str, NodeProcess], names: Sequence[str], rounds: int,
                messages: int) -> Turns:
    """Send messages through some nodes in turns, forth and back, so that none is always first."""
    turns: Turns = {name: [] for name in names}
    for turn in range(rounds):
        for name in names if turn % 2 == 0 else reversed(names):
            turns[name].append(_whole_stretch(bench, nodes[name], _JOINTS, _RATE, messages))
    return turns


def _whole_stretch(bench: Bench, node: NodeProcess, joints: int, rate: float,
                   count: int) -> Stretch:
    stretch = bench.stretch(node, joints, rate, count)
    if stretch.lost:
        raise RuntimeError(f'{node.joint_topic}: {stretch.lost} poses lost at {rate:.0f} Hz')
    return stretch


def _measure_starts(report: Report, bench: Bench, effort: Effort) -> None:
    seconds: dict[str, list[float]] = {'bare': [], 'ours': []}
    for turn in range(effort.starts):
        for name, readings in seconds.items():
            with closing(NodeProcess(f'start_{name}_{turn}', name)) as node:
                readings.append(bench.start_to_first_pose(node))
                bench.forget(node)
    report.section('4. start to first pose')
    for name, readings in seconds.items():
        report.row(name, figure(readings), 's')
    # Fast DDS announces a participant before that listens (RTPSParticipantImpl::enable). Who
    # answers too soon is not heard until it announces itself again, within 3 s; a third to a half
    # of all starts meet this, of any node, so that medians of some starts differ by chance.
    ours, bare = (percentile(seconds[name], 25) for name in ('ours', 'bare'))
    report.row('ours less bare, lower quartiles', difference([ours], [bare]), 's', at_most=0.5)


def _measure_saturation(report: Report, bench: Bench, effort: Effort) -> None:
    report.section('3. reliable QoS, every pose in order')
    with closing(NodeProcess('fast', 'ours').start()) as node:
        _match(bench, [node])
        count = 2 * effort.messages
        stretches = [bench.stretch(node, _JOINTS, 2000.0, count) for _ in range(effort.rounds)]
        poses = 2 * count * effort.rounds
        lost = sum(stretch.lost for stretch in stretches)
        report.row(f'lost at 2000 Hz, of {poses} poses', figure([float(lost)]), '', at_most=0)
        report.row('stretches out of order', figure([float(sum(
            not stretch.in_order for stretch in stretches))]), '', at_most=0)
        rate = 2000.0
        while effort.points and rate < _FASTEST:
            rate *= _RAMP
            stretch = bench.stretch(node, _JOINTS, rate, round(rate))
            if stretch.lost or not stretch.in_order:
                report.row('first rate at which a pose is lost', figure([rate]), 'Hz')
                break
        bench.forget(node)


def _match(bench: Bench, nodes: Iterable[NodeProcess]) -> None:
    for node in nodes:
        bench.watch(node)
    for node in nodes:
        bench.match(node)


def _measure_growth(report: Report, bench: Bench, effort: Effort) -> None:
    """Add the curves of joints, chains and rate to the picture."""
    with ExitStack() as stack:
        names = ('plain', 'ours', 'floor')
        nodes = {name: stack.enter_context(closing(NodeProcess(f'grow_{name}', name).start()))
                 for name in names}
        _match(bench, nodes.values())
        for joints in (12, 32, 64, 96, 128) if effort.points else (12, 128):
            _grow(report, bench, nodes, 'joints', joints, joints, _RATE, effort)
        keeping_up = nodes
        for rate in _RATES if effort.points else _RATES[:1]:
            names = _grow(report, bench, keeping_up, 'rate', rate, _JOINTS, rate, effort)
            keeping_up = {name: nodes[name] for name in names}
        for node in nodes.values():
            bench.forget(node)
    _measure_chains(report, bench, effort)


def _measure_chains(report: Report, bench: Bench, effort: Effort) -> None:
    chains, poses = ['left_leg', 'right_leg', 'head_imu'], [*POSES, 'head_imu/pose']
    with ExitStack() as stack:
        nodes = {}
        for count in range(1, 1 + len(chains)):
            parameters = (f'chains:=[{",".join(chains[:count])}]', 'head_imu.version:=v2')
            node = NodeProcess(f'chains_{count}', 'ours', poses[:count], parameters).start()
            nodes[str(count)] = stack.enter_context(closing(node))
        _match(bench, nodes.values())
        turns = _take_turns(bench, nodes, list(nodes), effort.rounds, effort.messages // 2)
        for count, stretches in turns.items():
            report.grow('chains', 'ours', int(count), figure([turn.cpu for turn in stretches]))
            bench.forget(nodes[count])


def _grow(report: Report, bench: Bench, nodes: dict[str, NodeProcess], panel: str, x: float,
          joints: int, rate: float, effort: Effort) -> list[str]:
    """Add a point to the curve of each node that keeps up; return the names of these."""
    count = round(rate * effort.messages / _RATE / 2)
    turns: Turns = {name: [] for name in nodes}
    for _ in range(min(3, effort.rounds)):
        for name, node in nodes.items():
            turns[name].append(bench.stretch(node, joints, rate, count))
    keeping_up = [name for name, stretches in turns.items() if not any(
        stretch.lost or stretch.latencies[-1] > _BEHIND for stretch in stretches)]
    for name in keeping_up:
        report.grow(panel, name, x, figure([stretch.cpu for stretch in turns[name]]))
    return keeping_up
