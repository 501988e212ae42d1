"""Settings of every test run: ROS 2 stays on this machine, in a domain of the run's own."""

import os
import re
import signal
import socket

from hypothesis import settings
import pytest

# The ports by which domain_coordinator, ROS 2's own tool for this, marks a domain as taken.
PORT_BASE = 32768
DOMAINS = 100


def claim_domain() -> tuple[int, socket.socket]:
    """Return a ROS domain that no other test run uses while the socket lives."""
    for i in range(DOMAINS):
        domain = (os.getpid() + i) % DOMAINS + 1
        claim = socket.socket()
        try:
            claim.bind(('', PORT_BASE + domain))
        except OSError:
            claim.close()
        else:
            return domain, claim
    raise RuntimeError(f'ROS domains 1 to {DOMAINS} are all taken by test runs')


# Set here, before any test imports rclpy, so that it and every child process see them.
domain_id, _claim = claim_domain()
os.environ['ROS_DOMAIN_ID'] = str(domain_id)
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

# A run in the background may have been told to ignore these, and every child process with it.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# How long an example takes says nothing on a busy machine. Every run tries other examples;
# `make test ARGS=--hypothesis-profile=thorough` tries more of them.
settings.register_profile('icub_leg_fk', deadline=None, max_examples=50)
settings.register_profile('thorough', deadline=None, max_examples=1000)
settings.load_profile('icub_leg_fk')


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report(collector):
    """Skip a file of tests, with the reason, whose imports from ROS 2 are not installed."""
    report = (yield).get_result()
    missing = re.search(
        r"No module named '(rclpy|\w+_(?:msgs|interfaces))", str(report.longrepr)
    )
    if report.failed and missing:
        report.outcome = 'skipped'
        report.longrepr = (
            str(collector.path),
            1,
            f'Skipped: needs {missing[1]} of ROS 2',
        )


@pytest.fixture
def written(tmp_path):
    """Return what writes a text, or bytes, to a file and returns its path."""

    def write(content, name='robot'):
        file = tmp_path / name
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        return file

    return write
