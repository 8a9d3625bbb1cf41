# Everything happens in $(VENV); nothing is installed elsewhere.
VENV ?= .venv
PYTHON ?= python3
WORKERS ?= 2

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input --quiet

.DEFAULT_GOAL := help
.PHONY: help demo test test-slow sb3 docs lint types bench kills cluster-faults lock clean

help: ## list the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /  \1\t/p' $(MAKEFILE_LIST) | expand -t 18

demo: $(VENV)/.runtime ## reproduce Case Study 1 with few runs, and write its report
	$(BIN)/tickwise reproduce case1 --quick --out runs/case1-quick

test: $(VENV)/.development ## run the tests
	$(BIN)/python -m pytest -n $(WORKERS) tests

test-slow: $(VENV)/.development ## run the longer studies too
	$(BIN)/python -m pytest -n $(WORKERS) -m "slow or not slow" tests

sb3: $(VENV)/.sb3 ## install Stable-Baselines3 and PyTorch too, so that `make test` has their tests

docs: $(VENV)/.development ## build the documentation in build/docs; a warning is an error
	NO_COLOR=1 $(BIN)/python -m sphinx -E -W --keep-going -q -b html docs build/docs

lint: $(VENV)/.development ## check style and layout
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.development ## check the types
	$(BIN)/mypy

# One core each, and an environment of its own: what the others need is nothing that tickwise needs.
bench: build/bench/.peers ## compare with C and with other libraries, in time and in growth; QUICK=1 for a short run
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 \
	  build/bench/bin/python -m benchmarks $(if $(QUICK),--quick --out runs/bench-quick) $(ONLY)

kills: $(VENV)/.runtime ## kill a reproduction a hundred times, and compare with one left alone
	$(BIN)/python benchmarks/kills.py

cluster-faults: $(VENV)/.development ## break a Dask cluster that reproduces a study, and compare with one left alone
	$(BIN)/python benchmarks/cluster.py

# The stamps say that an environment holds what a lock file names.
$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "tickwise needs Python 3.11 or later, but $(PYTHON) is $$($(PYTHON) --version 2>&1); say which: make PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.runtime: $(VENV)/.created requirements.lock pyproject.toml
	$(PIP) install --requirement requirements.lock
	$(PIP) install --no-deps --editable .
	@touch $@

$(VENV)/.development: $(VENV)/.runtime requirements-dev.lock
	$(PIP) install --requirement requirements-dev.lock
	@touch $@

# One that does not install is told of and left out; the benchmarks then say that it was skipped.
build/bench/.peers: requirements.lock benchmarks/requirements.txt pyproject.toml
	$(MAKE) --no-print-directory VENV=build/bench build/bench/.runtime
	@grep '==' benchmarks/requirements.txt | while read -r peer; do \
	  build/bench/bin/python -m pip --disable-pip-version-check --no-input --quiet install --no-deps "$$peer" \
	    || echo "$$peer does not install here: left out" >&2; \
	done
	@touch $@

# Stable-Baselines3 brings PyTorch, which is larger than all else together: whoever wants its tests asks for it.
$(VENV)/.sb3: $(VENV)/.development requirements-sb3.lock
	$(PIP) install --requirement requirements-sb3.lock
	@touch $@

# rtamt has no release for Python 3.13: run this with 3.11 or 3.12
FREEZE := build/lock/bin/python -m pip freeze --exclude tickwise
# which build of PyTorch, and what that build alone needs, is for each machine to choose
PORTABLE := sed -E '/^(nvidia|triton|cuda)/d; s/\+[a-z0-9.]+$$//'
PINS := sed -E 's/^(rtamt|antlr4-python3-runtime)==.*/&; python_version < "3.13"/'

lock: ## resolve the lock files anew
	rm -rf build/lock
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install --quiet .
	{ head -n 1 requirements.lock; $(FREEZE); } > build/runtime.lock
	build/lock/bin/python -m pip install --quiet '.[dev]'
	{ head -n 1 requirements-dev.lock; $(FREEZE) | $(PINS); } > build/development.lock
	build/lock/bin/python -m pip install --quiet '.[sb3]'
	{ head -n 1 requirements-sb3.lock; $(FREEZE) | $(PORTABLE) | $(PINS) | grep -vxFf build/development.lock; } > build/sb3.lock
	mv build/runtime.lock requirements.lock
	mv build/development.lock requirements-dev.lock
	mv build/sb3.lock requirements-sb3.lock

clean: ## remove the environment and what can be made again; runs/ stays
	rm -rf $(VENV) build dist .pytest_cache .hypothesis .mypy_cache .ruff_cache
	find src tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
