"""Add the poses of the feet to a fleet of recordings, on as many machines as Dask has workers.

python docs/fleet.py RECORDINGS OUTPUT [ADDRESS-OF-A-DASK-SCHEDULER]
"""

from pathlib import Path
import sys

from dask.distributed import Client
from icub_leg_fk.tools.add_poses import add_foot_poses

if __name__ == '__main__':
    recordings, output, *scheduler = sys.argv[1:]
    sources = sorted(path.parent for path in Path(recordings).glob('*/metadata.yaml'))
    with Client(*scheduler) as client:
        jobs = client.map(add_foot_poses, sources, [Path(output) / s.name for s in sources])
        for job in jobs:
            print(job.result() if job.exception() is None else job.exception())
