# Two commands: `make demo` and `make test`. Both need Python 3.11 or newer and make, nothing else.
# PYTHON=... picks another interpreter, PIP_ARGS=... are arguments of pip (another index, an offline folder of wheels),
# EXTRAS=... are the optional dependencies to install.

PYTHON ?= python3
PIP_ARGS ?=
EXTRAS ?= all,dev
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
WORKERS ?= 2
# Workers begin with halves of the list, so what the tests of a module share is mostly made once.
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

.DEFAULT_GOAL := help
.PHONY: help setup demo test slow full stress check bench docs notebooks clean

help:
	@echo "make demo    install, train a controller in a 5x5 maze, show the result"
	@echo "make test    install, run the tests, show the maze solve rates"
	@echo "make slow    the tests that take minutes"
	@echo "make full    the tests of test and of slow in one session"
	@echo "make stress  kills, damaged files, bad inputs: half an hour"
	@echo "make check   lint, types, direction of imports"
	@echo "make bench   measure what the README's table states (takes long)"
	@echo "make docs    the documentation as a site, in docs/_build"
	@echo "make notebooks  the tutorials as notebooks, executed, in docs/_build/notebooks"
	@echo "make setup   only prepare $(VENV)"

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "make: $(PYTHON) is too old: Python 3.11 or newer is needed (make PYTHON=python3.12 ...)" >&2; exit 2; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@rm -rf pbcs_ompl.egg-info  # an old one hides new entry points from everything that runs in this folder
	$(BIN)/python -m pip install --quiet $(PIP_ARGS) -c constraints.txt -e '.[$(EXTRAS)]'
	@touch $@

demo: setup
	@rm -rf runs/demo
	$(BIN)/pbcs train --env pbcs/Maze-v0 --env-kwargs '{"size": 5, "maze_seed": 1}' --seed 0 --out runs/demo

test: setup
	$(PYTEST)

slow: setup
	$(PYTEST) -m slow --ignore=tests/stress

full: setup
	$(PYTEST) -m '' --ignore=tests/stress

stress: setup
	$(BIN)/python -m pytest -m slow -s tests/stress

check: setup
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/basedpyright --warnings
	$(BIN)/lint-imports --no-logo

bench: setup
	@for script in tests/benchmarks/*.py tests/benchmarks/native_ompl/bench.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

docs: setup
	@$(BIN)/python -c 'import sphinx' 2>/dev/null || $(BIN)/python -m pip install --quiet $(PIP_ARGS) -c constraints.txt -e '.[docs]'
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build
	@echo "docs/_build/index.html"

notebooks: setup
	@$(BIN)/python -c 'import jupytext, nbclient, ipykernel' 2>/dev/null || \
		$(BIN)/python -m pip install --quiet $(PIP_ARGS) -c constraints.txt -e '.[docs]'
	$(BIN)/python docs/notebooks.py

clean:
	rm -rf build dist docs/_build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
