# `make demo` and `make test` need Python 3.11, git and make, and nothing else.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# One thread per process: two cores are better spent on two processes.
export OMP_NUM_THREADS ?= 1

.PHONY: install demo robot-demo test coverage lint docs wheel test-wheel test-lowest lock clean

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	test -x $(BIN)/python || $$(command -v $(PYTHON) || command -v python3) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

demo: install
	$(BIN)/imop run --task tabletop/lid_off_pot --seed 1 --out runs/demo

# From the calibration of cameras to the first motion, against the simulator; see docs/real-robot.md.
ROBOT_DEMO := runs/robot_demo
robot-demo: install
	rm -rf $(ROBOT_DEMO)
	$(BIN)/imop calibrate collect $(ROBOT_DEMO)/pictures --simulated beside
	$(BIN)/imop calibrate solve $(ROBOT_DEMO)/pictures
	$(BIN)/imop setup check examples/simulated_cell.toml
	$(BIN)/imop record $(ROBOT_DEMO)/drawer --simulated tabletop/open_drawer --seed 1 --save --store $(ROBOT_DEMO)/demo.zarr
	$(BIN)/imop check $(ROBOT_DEMO)/demo.zarr
	$(BIN)/imop run --robot examples/simulated_cell.toml --demo $(ROBOT_DEMO)/demo.zarr \
		--task tabletop/open_drawer --seed 2 --out $(ROBOT_DEMO)/run

test: install lint
	$(BIN)/pytest -n 2 --dist worksteal

# Lines that the tests run, by file; fails below 90 %.
coverage: install
	$(BIN)/pytest -n 2 --dist worksteal --cov --cov-report=term-missing:skip-covered

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The documentation as web pages, in site/; a broken link is an error.
docs: install
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# A source archive, and a wheel made from it.
wheel: install
	rm -rf dist
	$(BIN)/python -m build --outdir dist .

# The wheel in fresh environments and an empty folder.
test-wheel: wheel
	.ci/test_wheel $(abspath $(BIN))/python

# The lowest versions that pyproject.toml allows, with the tests of what uses them.
test-lowest: install
	mkdir -p build
	$(BIN)/python .ci/lowest.py > build/lowest.txt
	$(BIN)/python -m venv --clear build/lowest
	build/lowest/bin/pip install --quiet --disable-pip-version-check -c build/lowest.txt -e '.[sim,viz,train,calibrate]' \
		hypothesis pytest pytest-xdist
	build/lowest/bin/python -m pytest -n 2 --dist worksteal tests/demos tests/geometry tests/networks tests/policy \
		tests/robots tests/calibration tests/sim tests/evaluation tests/tasks/coppelia tests/tasks/test_env.py tests/test_cli.py \
		tests/training/loop tests/training/test_ablation.py tests/training/synthetic/test_routes.py

# Rewrites constraints.txt from what is installed now.
lock: install
	$(BIN)/python -m pip freeze --exclude-editable | grep -v '^-e' | sed 's/+cpu$$//' > constraints.txt

clean:
	rm -rf $(VENV) build dist site src/*.egg-info
