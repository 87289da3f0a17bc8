# Two commands for everybody: `make run` and `make test`. Both set up what they need on a fresh machine.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
# One BLAS thread per process: two processes with default threads were measured ten times slower.
export OMP_NUM_THREADS = 1
# A file of tests stays in one process, with what it prepares for all of its tests; each process takes a gigabyte. Files
# with a slow test run first, others in their order: that of the most tests first has those last that take a minute for
# each of five.
SIDE_BY_SIDE := --numprocesses=auto --maxprocesses=4 --dist=loadfile --no-loadscope-reorder
export MLFLOW_DISABLE_TELEMETRY = true
# A hundred processes that the tests start would each translate our sources again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test tests check lint types setup bench docs wheel-check clean

setup: $(VENV)/.ready  ## environment with the tested versions

$(VENV)/.ready: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt --group dev --editable \
		".[all,torch,mdf,tdms]"
# pip would translate twenty thousand files on one core, a fifth of them the libraries' own tests, which nobody runs here.
	$(BIN)/python -W ignore -m compileall -q -q -j 0 -x 'site-packages/.*/tests/' $(VENV)/lib || true
	touch $@

run: setup  ## the main job: traces, fits, export, report
	$(BIN)/sysid run service-brake

test: setup  ## everything that CI runs; the types are checked on a core that waits while the others collect and begin
	$(MAKE) --no-print-directory --jobs=2 lint types tests

tests: setup  ## the tests alone
	$(BIN)/python -m pytest $(SIDE_BY_SIDE)

lint: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: setup
	$(BIN)/mypy

bench: setup  ## the benchmarks, not part of the tests
	$(BIN)/python -m tests.benchmarks

docs: setup  ## the documentation site; every notebook of its gallery is run
	$(BIN)/python -m sphinx -q -W --keep-going -b html -d build/doctrees docs build/docs

wheel-check: setup  ## a wheel in a clean environment: its size, and the first hour
	$(BIN)/python -m tests.benchmarks.wheel_check

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache
