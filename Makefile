# Everything here sets itself up: a virtual environment in .venv, made anew when pyproject.toml changes.
# ARGS goes to the command: make evolve ARGS="--course hairpin --seed 7"

VENV := .venv
PY := $(VENV)/bin/python
# Python compiles a module when it is first imported: to compile all that libraries bring takes as long as to install them.
INSTALL := $(PY) -m pip --disable-pip-version-check install --quiet --no-compile --editable
ARGS ?=
# Without compiled modules kept, which some machines ask for, every process compiles all libraries anew: 5 s each.
export PYTHONDONTWRITEBYTECODE :=

# The first Python here that is new enough; set it yourself with: make env PYTHON=/path/to/python3.12
NEW_ENOUGH := import sys; print("yes" if sys.version_info >= (3, 11) else "")
PYTHON ?= $(firstword $(foreach name,python3 python3.14 python3.13 python3.12 python3.11 python,\
	$(if $(shell $(name) -c '$(NEW_ENOUGH)' 2>/dev/null),$(name))))

.DEFAULT_GOAL := help
.PHONY: help env evolve test check format docs bench concealed fuzz clean

help:  ## Show this list
	@echo "gecar: evolve programs for a line-following robot. Try: make evolve"
	@echo
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## (.*)/  make \1|\2/' | awk -F'|' '{ printf "%-15s %s\n", $$1, $$2 }'

env: $(VENV)/.runtime $(VENV)/.test $(VENV)/.check  ## Set up .venv with all that development needs

evolve: $(VENV)/.runtime  ## Evolve a program on the paper's course; results and pictures go to runs/evolve-001, ...
	@n=1; while [ -e "$$(printf 'runs/evolve-%03d' $$n)" ]; do n=$$((n + 1)); done; \
	$(PY) -m gecar evolve --out "$$(printf 'runs/evolve-%03d' $$n)" $(ARGS)

test: $(VENV)/.test $(VENV)/.node  ## Run the tests
	$(PY) -m pytest -n auto --dist worksteal $(ARGS)

check: $(VENV)/.check  ## Check format, style, types and which room imports which
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/ruff check
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

format: $(VENV)/.check  ## Put the sources in the format that check wants
	$(VENV)/bin/ruff format
	$(VENV)/bin/ruff check --fix

docs: $(VENV)/.docs  ## Build the documentation into build/docs, with a reference from docstrings; checks links
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build $(ARGS)

bench: $(VENV)/.cluster  ## Measure how fast gecar is, and print it as a table
	$(PY) -m benchmarks $(ARGS)

concealed: $(VENV)/.test  ## Examine gecar discover on concealed robots (hours; resumes)
	$(PY) -m benchmarks.concealed exam --out runs/concealed --report benchmarks/concealed/RESULTS.md $(ARGS)

fuzz: $(VENV)/.fuzz  ## Fuzz the readers of strangers' files, e.g. ARGS="--inputs 250000 --target grammar"
	$(PY) -m tests.fuzz $(ARGS)

clean:  ## Remove .venv and what tools leave behind; runs/ stays
	rm -rf $(VENV) tests/node/node_modules build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A machine may have pip but not ensurepip (Debian splits it off); pip can then fill the environment from outside.
$(PY):
	@if [ -z "$(PYTHON)" ]; then echo "error: found no Python 3.11 or newer, expected one as python3 (or: make env PYTHON=/path/to/python3.12)" >&2; exit 1; fi
	@if ! $(PYTHON) -c '$(NEW_ENOUGH)' 2>/dev/null | grep -q yes; then echo "error: found '$(PYTHON)' too old or missing, expected Python 3.11 or newer" >&2; exit 1; fi
	@echo "Making .venv with $$($(PYTHON) --version) ..."
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || { $(PYTHON) -m venv --clear --without-pip $(VENV) && $(PYTHON) -m pip --python $(PY) install --quiet pip; }

$(VENV)/.runtime: pyproject.toml | $(PY)
	@echo "Installing gecar and its libraries into .venv (once) ..."
	@$(INSTALL) .
	@touch $@

$(VENV)/.test $(VENV)/.check $(VENV)/.docs $(VENV)/.cluster $(VENV)/.fuzz: $(VENV)/.%: pyproject.toml $(VENV)/.runtime
	@echo "Installing what 'make $*' needs into .venv (once) ..."
	@$(INSTALL) '.[$*]'
	@touch $@

# MicroPython for the tests of exported programs. Without npm or a network those tests are skipped, and say so.
$(VENV)/.node: tests/node/package.json | $(PY)
	@if ! command -v npm >/dev/null; then echo "note: found no npm, tests that run exported programs will be skipped"; \
	else echo "Installing MicroPython into tests/node (once) ..."; \
	npm install --prefix tests/node --silent --no-audit --no-fund --no-package-lock --fetch-retries=1 --fetch-timeout=20000 \
	&& touch $@ || echo "note: npm could not install it, tests that run exported programs will be skipped"; fi
