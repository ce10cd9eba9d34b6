PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/installed
# pip would compile modules on one core; see below.
PIP := $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check
SHELL := /bin/bash

.DEFAULT_GOAL := help
.PHONY: help setup demo dynamics test test-all check lint audit dist docs docs-serve emps bench clean

help: ## list the commands
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(STAMP) ## make .venv with the pinned packages

$(STAMP): constraints.txt pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(PIP) "torch==$$(sed -n 's/^torch==//p' constraints.txt)"
	$(PIP) --constraint constraints.txt --editable ".[dev]"
# Where Python writes no bytecode (PYTHONDONTWRITEBYTECODE, usual in containers) each command would compile two
# thousand modules anew, for four seconds. Files of another Python's syntax fail, and are never imported.
	$(BIN)/python -m compileall -qq -j 0 -x '/tests/' $(VENV)/lib vision_s2r || true
	touch $@

demo: setup ## render, train, evaluate, diagnose a withheld robot, in 8 to 18 minutes: outputs/demo/index.html
	$(BIN)/vision-s2r run experiment=demo
	$(BIN)/vision-s2r close-gap experiment=demo

dynamics: setup ## identification, actuator network, randomized control, small: outputs/dynamics, about 6 minutes
	$(BIN)/vision-s2r identify example=two_point out=outputs/dynamics
	$(BIN)/vision-s2r identify recording=outputs/dynamics/log-0 out=outputs/dynamics/identified
	$(BIN)/vision-s2r actuator actuator=small out=outputs/dynamics/actuator
	$(BIN)/vision-s2r control follow control=small
	$(BIN)/vision-s2r control ablate control=small
	$(BIN)/vision-s2r control adr control=small

test: setup ## the tests, without the long ones
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m "not slow" --numprocesses 2 --dist loadfile --no-loadscope-reorder

test-all: setup ## every test
	$(BIN)/python -m pytest

check: lint dist docs ## lint, format, types; wheel and sdist build, and the documentation

lint: setup ## lint, format, types, and no secrets in any file
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy vision_s2r scripts
	git ls-files -z | grep -zvE '\.(png|jpg|ipynb|safetensors|csv)$$' | xargs -0 $(BIN)/detect-secrets-hook --no-verify

audit: setup ## known vulnerabilities of the pinned packages; asks the package index, so it needs a network
	$(PIP) --constraint constraints.txt --editable ".[audit]"
	$(BIN)/pip-audit --requirement constraints.txt --no-deps --disable-pip --strict

docs: setup ## the documentation, into build/site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

docs-serve: setup ## the documentation, at http://127.0.0.1:8000, built anew as it changes
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs serve

dist: setup ## wheel and sdist, checked: dist/
	rm -rf dist
	$(BIN)/python -m build --no-isolation --outdir dist .
	$(BIN)/twine check --strict dist/*

emps: setup ## fetch the measurements of a real axis that some tests want; needs a network
	$(BIN)/python tests/data/fetch_emps.py

bench: setup ## rendering speed against its limit and the usual loop
	$(BIN)/vision-s2r benchmark render

clean: ## remove the environment and what was made; rendered data stays
	rm -rf $(VENV) outputs build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
