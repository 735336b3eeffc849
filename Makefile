# make demo    a damper and a coil from the logs in datasets/ to models, in an environment of its own
# make demo-discover  which effect a model lacks, on two data sets in which one is hidden
# make test    linters, types and every test but the slow studies
# make help    the other targets

PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
BIN := $(VENV)/bin
MRFIT := $(BIN)/mrfit
WORK ?= demo-work
STUDIES ?= studies-work
JOBS ?= 2

# For `make batch`: every log like PATTERN under LOGS gets a workspace of its own under BATCH.
LOGS ?= datasets/coil
BATCH ?= batch-work
MODEL ?= boucwen-flux
OPT ?= pso-fmin
PATTERN ?= *.csv

.PHONY: help setup demo demo-discover test lint docs test-fmu test-browser test-slow bench benchmarks-public studies studies-long studies-checks discovery-benchmark batch datasets clean

help:
	@echo 'make demo       find what a model of a damper lacks and fit it, then a coil; say where report and picture lie'
	@echo 'make demo-discover  find the hidden effect in two of the data sets and say where the pages lie'
	@echo 'make test       lint, type-check and test'
	@echo 'make docs       build the pages, run their code and the README, into docs/build'
	@echo 'make test-fmu   install FMPy (200 MB) and test FMUs as models'
	@echo 'make test-browser  the report in a browser: hover, toggle, zoom (needs Chromium; installs Playwright, 45 MB)'
	@echo 'make test-slow  the long studies, FMUs as models, and work sent to a scheduler'
	@echo 'make bench      measure speed, as ratios in one run'
	@echo 'make studies    the studies of the papers, beside their published tables: docs/studies.md (five to ten minutes)'
	@echo 'make studies-long  what takes longer: all points of an optimizer study, discovery on real dampers'
	@echo 'make studies-checks  the studies on other rigs, and the checks behind what differs'
	@echo 'make discovery-benchmark  score discovery on hidden effects (hours; goes on where it was stopped)'
	@echo 'make batch LOGS=folder MODEL=name OPT=name JOBS=2   re-process every log under a folder, only what changed'
	@echo 'make datasets   make the logs in datasets/ again'
	@echo 'make clean      remove the environment and what demo and batch made'

setup: $(VENV)/installed

$(VENV)/installed: pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo 'mrfit needs Python 3.11 or newer on the PATH'; exit 1; }
	$(PYTHON) -m venv $(VENV) || { echo 'Python has no venv module here; on Debian: apt-get install python3-venv'; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

# The coil is fitted beside the damper, on another core.
demo: setup
	$(MRFIT) run pipelines/coil-eddy.toml --work $(WORK)/coil --quiet & coil=$$!; \
	$(MRFIT) run pipelines/damper.toml --work $(WORK)/damper; damper=$$?; \
	wait $$coil && exit $$damper
	$(MRFIT) figure parameters --format png --width 174mm --work $(WORK)/damper

demo-discover: setup
	$(MRFIT) run pipelines/discover-eddy.toml --work $(WORK)/discover-eddy
	$(MRFIT) run pipelines/discover-current-lag.toml --work $(WORK)/discover-current-lag

# To rewrite every assertion, so that it tells its values, takes each process 12 s: only those that fail are run again so.
test: export PYTHONDONTWRITEBYTECODE =
test: setup lint
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder -q --assert=plain || \
		{ test $$? -ne 1 || $(BIN)/python -m pytest --lf -q; false; }

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Sphinx is not in the environment of `make test`. A warning is an error.
$(VENV)/docs-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,docs]'
	@touch $@

docs: $(VENV)/docs-installed
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/build
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -q -m 'slow or not slow' tests/docs
	$(BIN)/python -m tests.docs.command_lines
	@echo 'Pages: docs/build/index.html'

# FMPy, of 200 MB, is not in the environment of `make test`, which skips the tests of FMUs.
$(VENV)/fmu-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,fmu]'
	@touch $@

test-fmu: $(VENV)/fmu-installed
	$(BIN)/python -m pytest -q -rs tests/core/foreign

# dask.distributed is not in the environment of `make test` either, which skips the tests of schedulers.
$(VENV)/dask-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,dask]'
	@touch $@

# Playwright, of 45 MB, drives a Chromium that is on the machine; the report's page is tested in it.
$(VENV)/browser-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,browser]'
	@touch $@

test-browser: $(VENV)/browser-installed
	$(BIN)/python -m pytest -q -rs -m slow tests/report/test_browser.py

test-slow: test-fmu $(VENV)/dask-installed
	$(BIN)/python -m pytest -q -m slow

bench: setup
	$(BIN)/python -m benchmarks

benchmarks-public: setup
	$(BIN)/python -m benchmarks.public_benchmarks $(BENCHMARKS) > docs/public_benchmarks.md

studies: setup
	$(BIN)/python -m benchmarks.studies --work $(STUDIES)

studies-long: setup
	$(BIN)/python -m benchmarks.studies --work $(STUDIES) --long

studies-checks: setup
	$(BIN)/python -m benchmarks.studies --work $(STUDIES) --checks

discovery-benchmark: setup
	$(BIN)/python -m benchmarks.discovery --full --jobs $(JOBS) --keep discovery-work --out discovery-work/result.md

datasets: setup
	$(BIN)/python -m datasets.make_coil_logs
	$(BIN)/python -m datasets.make_discovery_logs
	$(BIN)/python -m datasets.make_damper_logs

clean:
	rm -rf $(VENV) $(WORK) $(BATCH) $(STUDIES) discovery-work docs/build docs/generated docs/jupyter_execute

# Every log under LOGS has a workspace with a report under BATCH; what has not changed is not done again.
batch: setup
	$(MRFIT) batch '$(LOGS)' --like '$(PATTERN)' --model '$(MODEL)' --opt '$(OPT)' --report --work '$(BATCH)' --jobs $(JOBS)
