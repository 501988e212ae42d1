"""Warnings are heard at once, and then no more often than every five seconds for each reason."""

from icub_leg_fk.ros.throttle import ThrottledWarnings
import pytest


@pytest.fixture
def clock(monkeypatch):
    """Return a list that holds the present time [s]."""
    now = [100.0]
    monkeypatch.setattr('time.monotonic', lambda: now[0])
    return now


def test_each_reason_is_heard_at_once_and_then_counted(clock):
    heard = []
    warn = ThrottledWarnings(heard.append)
    for _ in range(3):
        warn('stale_joint', 'l_knee')
        warn('malformed', 'name')
    assert heard == ['stale_joint: l_knee', 'malformed: name']
    clock[0] += 4.9
    warn('stale_joint', 'l_knee')
    assert len(heard) == 2
    clock[0] += 0.2
    warn('stale_joint', 'l_hip_yaw')
    assert heard[2:] == ['stale_joint: l_hip_yaw (and 3 more)']
    clock[0] += 5.1
    warn('stale_joint', 'l_hip_yaw')
    assert heard[3:] == ['stale_joint: l_hip_yaw']
