# make analyze   the main job on an example crash (sets up .venv when it is missing)
# make test      what protects a change, within minutes: style, types, import rules, tests
# make test-flights  the rest of the tests: whole flights, and damaged logs by the hundred (minutes)
# make near      the tests that what differs from main touches (seconds); BASE=HEAD: what is not committed
# make land      moves main to this commit if all that CI runs is green on it, in a clone (tools/land)
# make docs      the pages of docs and the docstrings as a site, build/site/index.html
# make notebooks all notebooks, run from beginning to end
# make test-lowest  a part of them with the lowest versions of all libraries, on Python 3.11
# make test-newest  the same with the newest ones, on Python 3.13
# make conformance  every value of every log in ../shared against the reference readers (minutes)
# make metamorphic  what must not change an answer, on ten flights or more each in ../shared (minutes)
# make page      the reports of all examples, driven in a browser (a minute; needs chromium)
# make soak      200,000 mutated logs through all readers, 10,000 through the analysis, 5,000 and 500 more with
#                damaged clocks, and every test that is too long for the others (hours); COUNT=2000 tries fewer
# make fit       the weights of the diagnosis, anew from all labelled flights in ../shared (minutes)
# make bench     the figures that docs and README quote (make figures is the same)
# make clean     removes what was built; .venv stays

# Nothing but Python 3.11 (or newer) and make is needed beforehand; another Python: make PYTHON=/path/to/python
PYTHON ?= $(shell command -v python3 || command -v python3.11 || echo python3)
VENV ?= .venv
BIN := $(VENV)/bin
LOG ?= examples/crash_logs/copter_motor_failure_crash.tlog
OUT ?= build/example.fdi

# A shell may forbid Python to keep what it compiles; every process of a run would compile all of it anew.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := analyze
.DELETE_ON_ERROR:
.PHONY: analyze page test suite near test-flights land docs notebooks test-lowest test-newest lint conformance metamorphic soak fit bench figures clean

analyze: $(VENV)/.installed-run
	@mkdir -p $(dir $(OUT))
	$(BIN)/fdi analyze $(LOG) --out $(OUT) --force

# Side by side: the check of types keeps one core busy for as long as a tenth of the tests takes
test: $(VENV)/.installed-test
	@$(MAKE) --no-print-directory -j2 lint suite

suite: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n auto --dist loadfile

BASE ?= main

near: $(VENV)/.installed-test
	@touched=$$($(BIN)/python tools/near $(BASE)) || exit; \
	  if [ -n "$$touched" ]; then $(BIN)/python -m pytest -n auto --dist loadfile $$touched; \
	  else echo "near: nothing that differs from $(BASE) has tests of its own"; fi

test-flights: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n auto --dist loadfile -m "flights and not soak"

land:
	tools/land $(COMMIT)

notebooks: $(VENV)/.installed-test
	$(BIN)/python -m pytest -o addopts=-q -n auto --nbmake notebooks/*.ipynb

# -W: what Sphinx warns of is an error; -E: no page is taken from an earlier build
docs: $(VENV)/.installed-test
	$(BIN)/python -m sphinx -W --keep-going -E -q -b html docs build/site
	@echo "build/site/index.html"

# What depends on versions: what is read, and what is said of it. Promotion of numpy's types
# differs before 2.0, and numpy tells where that changes a result.
OF_VERSIONS := tests/test_versions.py tests/telemetry/test_frames.py tests/telemetry/test_dataflash.py \
  tests/telemetry/test_ulog.py tests/telemetry/test_meaning.py tests/telemetry/test_compiled.py
TELL_PROMOTION := NPY_PROMOTION_STATE=weak_and_warn
LOWEST := $(shell python3.11 -c '' 2>/dev/null && echo python3.11)
NEWEST := $(shell python3.13 -c '' 2>/dev/null && echo python3.13)

test-lowest: $(if $(LOWEST),$(VENV)-lowest/.installed,)
ifeq ($(LOWEST),)
	@echo "test-lowest: skipped, there is no python3.11 (make LOWEST=/path/to/python3.11)"
else
	$(VENV)-lowest/bin/python -m pytest $(OF_VERSIONS)
	$(TELL_PROMOTION) $(VENV)-lowest/bin/python -m pytest -W "error:result dtype changed" $(OF_VERSIONS)
endif

test-newest: $(if $(NEWEST),$(VENV)-newest/.installed,)
ifeq ($(NEWEST),)
	@echo "test-newest: skipped, there is no python3.13 (make NEWEST=/path/to/python3.13)"
else
	$(VENV)-newest/bin/python -m pytest $(OF_VERSIONS)
endif

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

conformance: $(VENV)/.installed-test
	PYTHONPATH=tests $(BIN)/python -m telemetry.conformance

metamorphic: $(VENV)/.installed-test
	PYTHONPATH=tests $(BIN)/python -m metamorphic
	$(BIN)/python -m pytest -m soak tests/test_metamorphic.py

page: $(VENV)/.installed-test
	$(BIN)/python -m pytest -m "soak or not soak" tests/report/page

COUNT ?= 200000

soak: $(VENV)/.installed-test
	PYTHONPATH=tests $(BIN)/python -m telemetry.fuzz --count $(COUNT)
	PYTHONPATH=tests $(BIN)/python -m telemetry.fuzz --count $$(( $(COUNT) / 20 )) --analyze
	PYTHONPATH=tests $(BIN)/python -m telemetry.fuzz --count $$(( $(COUNT) / 40 )) --clocks
	PYTHONPATH=tests $(BIN)/python -m telemetry.fuzz --count $$(( $(COUNT) / 400 )) --clocks --analyze
	$(BIN)/python -m pytest -m soak

fit: $(VENV)/.installed-test
	$(BIN)/python benchmarks/fit.py --write

bench figures: $(VENV)/.installed-test
	@set -e; for file in benchmarks/*.py; do echo "== $$file"; $(BIN)/python "$$file"; done

# A stamp is newer than what it was installed from; the install is editable, so changed code needs no new one.
# Python compiles what is used at its first use: compiling all of the libraries takes as long as installing them.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt
$(VENV)/.installed-run: pyproject.toml constraints.txt | $(BIN)/pip
	$(INSTALL) -e .
	@touch $@

$(VENV)/.installed-test: pyproject.toml constraints.txt | $(BIN)/pip
	$(INSTALL) -e '.[test]'
	@touch $@ $(VENV)/.installed-run

$(VENV)-lowest/.installed: pyproject.toml constraints-lowest.txt
	$(LOWEST) -m venv $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints-lowest.txt -e '.[fast]' pytest hypothesis
	@touch $@

$(VENV)-newest/.installed: pyproject.toml
	$(NEWEST) -m venv $(VENV)-newest
	$(VENV)-newest/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --upgrade -e '.[fast]' pytest hypothesis
	@touch $@

# pip, not python, is the target: where the venv module is only half there, python appears all the same.
$(BIN)/pip:
	@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "fdi needs Python 3.11 or newer, this is %d.%d; try: make PYTHON=python3.11" % sys.version_info[:2])'
	$(PYTHON) -m venv $(VENV)

clean:
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find fdi tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
