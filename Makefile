# make demo   the node on a walking robot, live in this terminal; saves a picture
# make test   linters and tests        make lint   linters alone
# make bench  speed beside references  make soak MINUTES=10  endurance
# All set up .venv first; they need make and Python 3.10 to 3.13, no ROS.

PYTHONS = python3.12 python3.11 python3.13 python3.10 python3
MINUTES = 10
PYTEST = .venv/bin/python -m pytest
USABLE = import sys, venv, ensurepip; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))
SETTINGS = setup.py pyproject.toml

# A sourced ROS, or settings for one, must not mix with the ROS in .venv.
unexport PYTHONPATH PYTHONHOME LD_LIBRARY_PATH AMENT_PREFIX_PATH RMW_IMPLEMENTATION
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Compiled modules are kept, as in an installed package: without them every start takes longer.
unexport PYTHONDONTWRITEBYTECODE
export ROS_AUTOMATIC_DISCOVERY_RANGE = LOCALHOST
export PIP_DISABLE_PIP_VERSION_CHECK = 1
export PIP_USE_PEP517 = 1

.PHONY: demo test lint bench soak clean

demo: .venv/.ros
	.venv/bin/leg_fk demo

test: .venv/.test
	$(PYTEST) --numprocesses=auto --maxprocesses=4 --dist=loadfile --durations=10 $(ARGS)

lint: .venv/.test
	$(PYTEST) test/test_lint.py test/test_flake8.py test/test_pep257.py

bench: .venv/.bench
	.venv/bin/python -m bench $(ARGS)

soak: .venv/.ros
	.venv/bin/python -m bench.soak --minutes $(MINUTES)

clean:
	rm -rf .venv build install log *.egg-info

.venv/.ros: .venv/.python $(SETTINGS)
	@echo 'Installing ROS 2 and the tools into .venv (about 400 MB, once)'
	@.venv/bin/python -m pip install --quiet --editable '.[ros,tools]'
	@touch $@

.venv/.test: .venv/.ros
	@echo 'Installing the test tools into .venv (once)'
	@.venv/bin/python -m pip install --quiet --editable '.[test]'
	@touch $@

.venv/.bench: .venv/.ros
	@for library in pin roboticstoolbox-python PyKDL; do \
	  .venv/bin/python -m pip install --quiet $$library || \
	    echo "make: without $$library, which cannot be installed here" >&2; \
	done; touch $@

.venv/.python:
	@for python in $(PYTHONS); do \
	  if $$python -c '$(USABLE)' 2>/dev/null; then \
	    $$python -m venv --clear .venv && touch $@ && exit; \
	  fi; \
	done; \
	echo 'make: no Python 3.10 to 3.13 with venv found, tried: $(PYTHONS)' >&2; exit 1
