# Every habit of the project is one of these words.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ALONE := $(VENV)/.alone
STAMP := $(VENV)/.ready
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check

# What `make test-services` needs, as Debian calls it.
SERVICES := gcc gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm cppcheck  # controllers, a MISRA checker
SERVICES += gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user mingw-w64 wine clang strace  # ARM, Windows, macOS
SERVICES += mosquitto postgresql prometheus chromium  # a broker, a database and eyes for `driftwise live`

.PHONY: run test test-all hostile test-services services check format mutants bench score worlds judge motions claims docs clean

$(ALONE): pyproject.toml  # the package alone: what whoever uses it installs
	$(PYTHON) -c 'import sys; sys.exit("driftwise needs Python 3.11 or newer" if sys.version_info < (3, 11) else 0)'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) -e .
	touch $@

$(STAMP): $(ALONE) studies/pyproject.toml  # with every optional part, the studies and the developers' tools
	$(INSTALL) -e '.[dev]' -e ./studies
	touch $@

run: $(ALONE)  ## estimate the embedded flight, print a table, write a report
	@mkdir -p out
	@$(BIN)/driftwise demo --report out/flight.html

test: $(STAMP)  ## the tests, a few minutes
	$(BIN)/python -m pytest -m "not slow and not service" -n 2 --dist loadfile --no-loadscope-reorder

test-all: $(STAMP)  ## the tests, the slow statistics, and what is tried with programs that are installed apart
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

hostile: $(STAMP)  ## two hundred drawn files, fifty signals and faults, five hundred requests, with the seed of the last commit
	$(BIN)/python -m tests.hostile

services:  ## install those programs (Debian, as root)
	apt-get install -y --no-install-recommends $(SERVICES)

test-services: $(STAMP)  ## controllers, brokers, databases, browsers; what is not installed is skipped, loudly
	$(BIN)/python -m pytest -m service -s

check: $(STAMP)  ## format, lint, types, import floors; every loop translates
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python scripts/translate_all.py

format: $(STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

mutants: $(STAMP)  ## change one line of the package at a time: does the test notice that says so?
	$(BIN)/python scripts/mutants.py

bench: $(STAMP)  ## speed and memory, as ratios in one run; writes bench.json, docs/benchmarks.md and its figure
	$(BIN)/python -m bench --docs docs

score: $(STAMP)  ## accuracy on recordings (DRIFTWISE_DATA), with the cases we lose; writes score.json and docs/score.md
	$(BIN)/driftwise score --json score.json --page docs/score.md

worlds: $(STAMP)  ## the default memory on the three hundred systems that constants are chosen on
	$(BIN)/python -m driftwise_studies.score.worlds.judge --page --processes 0

judge: $(STAMP)  ## and on three hundred drawn by the last commit that changed a constant; appended to docs/judged.md
	$(BIN)/python -m driftwise_studies.score.worlds.judge --judge --processes 0

motions: $(STAMP)  ## tracks of six hundred drawn scenes beside their truth; JUDGE=--judge writes docs/judged.md
	$(BIN)/python -m driftwise_studies.score.motions.judge --processes 0 $(JUDGE)

claims: $(STAMP)  ## what `driftwise run FILE` claims of four hundred drawn files, true or not; JUDGE=--judge writes docs/judged.md
	$(BIN)/python -m driftwise_studies.score.claims.judge --files 400 --processes 0 $(JUDGE)

docs: $(STAMP)  ## draw the figures, run every example of the documentation, build the site into site/, check its links
	$(BIN)/python scripts/make_figures.py
	$(BIN)/python -m pytest tests/test_docs.py
	$(BIN)/python -m sphinx -q -W --keep-going -d build/doctrees docs site
	$(BIN)/python scripts/reference.py --check
	$(BIN)/python scripts/check_site.py site

clean:
	rm -rf $(VENV) out site build dist docs/reference docs/gallery docs/tutorials
