# make demo   the node on a walking robot, live in this terminal; saves a picture
# make test   linters and tests        make test ROS=kilted   the tests on ROS 2 Kilted
# make lint   linters alone            make docs              the documentation, in build/html
# make bench  speed beside references  make soak MINUTES=10   endurance
# make readme every command of the README, in a fresh environment
# make sdist  the source distribution, and the tests from within it
# All set up .venv first; they need make and Python 3.10 to 3.13, no ROS.

PYTHONS = python3.12 python3.11 python3.13 python3.10 python3
MINUTES = 10
ROS = jazzy
USABLE = import sys, venv, ensurepip; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))
SETTINGS = setup.py pyproject.toml
ifeq ($(ROS),kilted)
VENV = .venv-kilted
NODE = ros-kilted,tools
TEST = $(NODE),test
else
VENV = .venv
NODE = ros,tools
TEST = $(NODE),test,test-jazzy
endif
PYTHON = $(VENV)/bin/python
PYTEST = $(PYTHON) -m pytest
# uv needs a quarter of pip's time. Only pip reads pip's own settings, so it tries where uv fails.
UV = $(PYTHON) -m uv pip install --python $(PYTHON) --compile-bytecode --quiet
INSTALL = $(UV) $(1) 2>/dev/null || $(PYTHON) -m pip install --quiet $(1)

# A sourced ROS, or settings for one, must not mix with the ROS in .venv.
unexport PYTHONPATH PYTHONHOME LD_LIBRARY_PATH AMENT_PREFIX_PATH RMW_IMPLEMENTATION
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Compiled modules are kept, as in an installed package: without them every start takes longer.
unexport PYTHONDONTWRITEBYTECODE
export ROS_AUTOMATIC_DISCOVERY_RANGE = LOCALHOST
export PIP_DISABLE_PIP_VERSION_CHECK = 1
export PIP_USE_PEP517 = 1

.PHONY: demo test lint docs bench soak readme sdist clean

demo: $(VENV)/.ros
	$(VENV)/bin/leg_fk demo

test: $(VENV)/.test
	$(PYTEST) --numprocesses=auto --maxprocesses=4 --dist=loadfile --durations=10 $(ARGS)

lint: $(VENV)/.test
	$(PYTEST) test/packaging/test_lint.py test/packaging/test_flake8.py test/packaging/test_pep257.py

docs: $(VENV)/.docs
	$(PYTHON) -m sphinx -W --keep-going -q docs build/html
	@echo 'open build/html/index.html'

bench: $(VENV)/.bench
	$(PYTHON) -m bench $(ARGS)

soak: $(VENV)/.ros
	$(PYTHON) -m bench.soak --minutes $(MINUTES)

readme: $(VENV)/.test
	README_BLOCKS=1 $(PYTEST) test/packaging/test_readme.py -k every_block -rA $(ARGS)

# What the source distribution lacks, the tests in it miss.
sdist: $(VENV)/.test
	rm -rf build/sdist && mkdir -p build/sdist
	$(PYTHON) setup.py --quiet sdist --dist-dir build/sdist
	cd build/sdist && tar -xzf *.tar.gz && cd icub_leg_fk-*/ && \
	  PYTHONPATH=$$PWD $(abspath $(PYTHON)) -m pytest --numprocesses=auto --maxprocesses=4 \
	  --dist=loadfile $(ARGS)

clean:
	rm -rf .venv .venv-kilted build install log *.egg-info

$(VENV)/.ros: $(VENV)/.python $(SETTINGS)
	@echo 'Installing ROS 2 and the tools into $(VENV) (about 600 MB, once)'
	@$(call INSTALL,--editable '.[$(NODE)]')
	@touch $@

$(VENV)/.test: $(VENV)/.python $(SETTINGS)
	@echo 'Installing ROS 2 and the test tools into $(VENV) (about 2 GB, once)'
	@$(call INSTALL,--editable '.[$(TEST)]')
	@touch $(VENV)/.ros $@

$(VENV)/.docs: $(VENV)/.python $(SETTINGS)
	@$(call INSTALL,--editable '.[docs]')
	@touch $@

$(VENV)/.bench: $(VENV)/.ros
	@$(call INSTALL,pin) || \
	  echo 'make: without Pinocchio (pin), which cannot be installed here' >&2
	@touch $@

$(VENV)/.python:
	@for python in $(PYTHONS); do \
	  if $$python -c '$(USABLE)' 2>/dev/null; then \
	    $$python -m venv --clear $(VENV) && touch $@ && exit; \
	  fi; \
	done; \
	echo 'make: no Python 3.10 to 3.13 with venv found, tried: $(PYTHONS)' >&2; exit 1
	@$(PYTHON) -m pip install --quiet uv 2>/dev/null || true
