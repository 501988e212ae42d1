# PYTHON_ARGCOMPLETE_OK
"""`python -m icub_leg_fk` is `leg_fk`."""

import sys

from icub_leg_fk.tools.leg_fk import main

sys.exit(main())
