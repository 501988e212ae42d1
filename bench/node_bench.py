"""The node beside its references, all at 1 kHz with 32 joints and two feet.

Nodes run side by side and get their messages in turns, so that whatever else the machine does
meets all of them; every ratio is of two stretches that followed one another.
"""

from __future__ import annotations

from contextlib import closing, ExitStack

from bench.node_process import Bench, NodeProcess, POSES, Stretch, TWISTS
from bench.report import percentile, ratio, Report

_JOINTS = 32
_RATE = 1000.0  # Hz
_RAMP = 1.25
_FASTEST = 60000.0  # Hz
_COMPARED = ('floor', 'ours', 'plain')


def measure_node(report: Report, quick: bool) -> None:
    """Add CPU, latency, memory, and the first rate at which a pose is lost."""
    with closing(Bench()) as bench:
        _measure_side_by_side(report, bench, *((2, 50) if quick else (12, 1000)))
        _measure_saturation(report, bench, quick)


def _measure_side_by_side(report: Report, bench: Bench, rounds: int, messages: int) -> None:
    with ExitStack() as stack:
        nodes = {name: stack.enter_context(closing(node.start())) for name, node in {
            'floor': NodeProcess('floor', 'floor'),
            'ours': NodeProcess('ours', 'ours'),
            'plain': NodeProcess('plain', 'plain'),
            'twists': NodeProcess('twists', 'ours', (*POSES, *TWISTS), ('publish_twist:=true',)),
        }.items()}
        bench.match([*nodes.values()])
        turns: dict[str, list[Stretch]] = {name: [] for name in (*_COMPARED, 'twists')}
        for turn in range(rounds):  # forth and back, so that none is always first
            for name in turns if turn % 2 == 0 else reversed(turns):
                turns[name].append(bench.stretch(nodes[name], _JOINTS, _RATE, messages))
        resident = {name: node.resident_bytes() / 1e6 for name, node in nodes.items()}
        for node in nodes.values():
            bench.forget(node)
    cpu = {name: [turn.cpu for turn in stretches] for name, stretches in turns.items()}
    p50, p99 = ({name: [percentile(turn.latencies, percent) for turn in turns[name]]
                 for name in _COMPARED} for percent in (50, 99))
    report.section(f'node: CPU per message, two feet, {_RATE:.0f} Hz, {_JOINTS} joints')
    for name in (*_COMPARED, 'twists'):
        label = {'ours': 'here', 'twists': 'here, with two twists'}.get(name, name)
        report.row(f'CPU, {label}', cpu[name], 'us')
    report.row('CPU, here / floor', ratio(cpu['ours'], cpu['floor']), 'x', at_most=1.3)
    report.row('CPU, here / plain', ratio(cpu['ours'], cpu['plain']), 'x', at_most=0.32)
    report.section('node: latency, JointState sent to PoseStamped received')
    for name in _COMPARED:
        label = 'here' if name == 'ours' else name
        report.row(f'p50, {label}', p50[name], 'us')
        report.row(f'p99, {label}', p99[name], 'us')
    report.row('p50, here / floor', ratio(p50['ours'], p50['floor']), 'x', at_most=1.2)
    report.section('node: resident size')
    for name in _COMPARED:
        report.row('here' if name == 'ours' else name, [resident[name]], 'MB')


def _measure_saturation(report: Report, bench: Bench, quick: bool) -> None:
    report.section('node: reliable QoS, every pose in order')
    with closing(NodeProcess('fast', 'ours').start()) as node:
        bench.match([node])
        rate = 2000.0
        while rate < (2100.0 if quick else _FASTEST):
            stretch = bench.stretch(node, _JOINTS, rate, round(rate))
            if stretch.lost or not stretch.in_order:
                report.row('first rate at which a pose is lost', [rate], 'Hz')
                break
            rate *= _RAMP
        else:
            report.note(f'none lost up to {rate / _RAMP:.0f} Hz')
        bench.forget(node)
