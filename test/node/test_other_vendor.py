"""A client without ROS, on another vendor's DDS, speaks to the node.

It is a process of its own, with settings of its own: two DDS libraries in one process would not
show that two programs understand each other.
"""

from importlib.util import find_spec
import json
import os
from pathlib import Path
import struct
import subprocess
import sys

from icub_leg_fk import Catalog
import numpy as np
import pytest
from support.node_harness import BOTH, FEET, LOSSLESS, NodeProcess

pytestmark = pytest.mark.skipif(
    find_spec('cyclonedds') is None,
    reason="Cyclone DDS's Python is not installed; Jazzy's tests have it",
)

CLIENT = Path(__file__).parents[1] / 'support' / 'cyclone_client.py'
LOOPBACK_ALONE = """<CycloneDDS><Domain>
    <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
    <Discovery><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
FIRST = 100  # s; stamp of the first posture
CHAINS = ('left_leg', 'right_leg')


def client_answers(namespace, postures):
    """Let the client send postures of both legs; return by foot what it has received."""
    task = {
        'domain': int(os.environ['ROS_DOMAIN_ID']),
        'namespace': namespace,
        'feet': FEET,
        'names': BOTH,
        'first': FIRST,
        'postures': postures.tolist(),
    }
    environment = {**os.environ, 'CYCLONEDDS_URI': LOOPBACK_ALONE}
    client = subprocess.run(
        [sys.executable, CLIENT],
        input=json.dumps(task),
        env=environment,
        capture_output=True,
        text=True,
        timeout=180,
    )
    assert client.returncode == 0, client.stderr
    return json.loads(client.stdout)


def bits(pose):
    """Return the bytes of a pose's seven numbers."""
    return struct.pack('<7d', *pose)


def test_a_client_of_another_vendor_gets_every_pose_to_the_last_bit():
    postures = np.random.default_rng(7).uniform(-0.5, 0.5, (200, 12))
    with NodeProcess(LOSSLESS) as node:
        answers = client_answers(node.namespace, postures)
    assert 'cyclonedds' not in sys.modules
    catalog = Catalog.load()
    for foot, name, q in zip(FEET, CHAINS, np.split(postures, 2, axis=1), strict=True):
        chain = catalog.chain(name, 'v2_5')
        assert [sec for sec, *_ in answers[foot]] == list(range(FIRST, FIRST + 200))
        received = [bits(pose) for _, *pose in answers[foot]]
        assert received == [bits(chain.pose(positions)) for positions in q]
