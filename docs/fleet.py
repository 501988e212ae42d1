"""Add the poses of the feet to a fleet of recordings, on as many machines as Dask has workers.

python docs/fleet.py RECORDINGS OUTPUT [ADDRESS-OF-A-DASK-SCHEDULER]

Exits with status 1 if a recording could not be read.
"""

from pathlib import Path
import sys

from dask.distributed import Client
from icub_leg_fk.tools.add_poses import add_foot_poses

if __name__ == '__main__':
    recordings, output, *scheduler = sys.argv[1:]
    sources = sorted(path.parent for path in Path(recordings).glob('*/metadata.yaml'))
    targets = [Path(output) / source.name for source in sources]
    Path(output).mkdir(parents=True, exist_ok=True)
    failed = 0
    with Client(*scheduler) as client:
        for job in client.map(add_foot_poses, sources, targets):
            if job.exception() is None:
                print(job.result())
            else:
                print(job.exception(), file=sys.stderr)
                failed += 1
    if failed:
        sys.exit(f'{failed} of {len(sources)} recordings failed')
