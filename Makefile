# Every target works as the first command on a fresh machine: .venv is made on demand.
VENV ?= .venv
BIN := $(VENV)/bin
PYTHON ?= python3
# One BLAS thread a process: the problems are small and the processes are many.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
DEMO ?= build/demo
# How long `make fuzz` takes, over all targets.
MINUTES ?= 10

.PHONY: demo test kernels lowest test-lowest check format docs bench figures acceptance mutants fuzz site dist clean

# Versions of dependencies, and which extra is installed.
CONSTRAINTS ?= constraints.txt
EXTRA ?= dev

$(VENV)/.installed: pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint $(CONSTRAINTS) torch
	$(BIN)/python -m pip install --quiet --constraint $(CONSTRAINTS) --editable '.[$(EXTRA)]'
	touch $@

demo: $(VENV)/.installed
	$(BIN)/facert demo $(DEMO) --overwrite
	$(BIN)/facert train $(DEMO)/training.h5 -o $(DEMO)/model.safetensors --overwrite
	$(BIN)/facert retarget $(DEMO)/performance.h5 $(DEMO)/retargeted.h5 --model $(DEMO)/model.safetensors --overwrite
	$(BIN)/facert render $(DEMO)/retargeted.h5 $(DEMO)/faces.png --rig $(DEMO)/character.h5 --truth $(DEMO)/performance.h5 --overwrite
	$(BIN)/facert plot $(DEMO)/retargeted.h5 $(DEMO)/curves.png --truth $(DEMO)/performance.h5 --overwrite
	@echo "Look at $(DEMO)/faces.png and $(DEMO)/curves.png"

test: $(VENV)/.installed
	$(BIN)/python -m pytest -n 2 --dist worksteal

# Where linear algebra decides: these pass with the kernels of any processor. By two threads those
# that do not train: models are trained by one thread, whatever is set.
NUMERICAL := $(addprefix tests/,models methods preprocess topology retarget regions mesh posing)
TWO_THREADS := $(addprefix tests/,topology mesh models/test_threads.py methods/test_regressions.py)
KERNELS = $(BIN)/python -m experiments.reliability.processors
PYTEST = $(BIN)/python -m pytest

kernels: $(VENV)/.installed
	$(KERNELS) --only avx512,avx2,sse -- $(PYTEST) -n 2 --dist worksteal -m 'not real' $(NUMERICAL)
	$(KERNELS) --only avx512,avx2,sse --threads 2 -- $(PYTEST) -m 'not real' $(TWO_THREADS)

# The same with the lowest versions that pyproject.toml allows. Torch is the one of constraints.txt:
# others are several gigabytes. Where the packages cannot be had, pip says why and nothing is tested.
LOWEST := VENV=.venv-lowest CONSTRAINTS=build/constraints-lowest.txt EXTRA=test

lowest:
	mkdir -p build
	$(PYTHON) .ci/lowest.py --but torch > build/constraints-lowest.txt
	if $(MAKE) .venv-lowest/.installed $(LOWEST); then $(MAKE) test-lowest $(LOWEST); \
	else echo "skipped: the lowest versions of dependencies cannot be installed here"; fi

test-lowest: $(VENV)/.installed
	$(KERNELS) --only avx2 -- $(PYTEST) -n 2 --dist worksteal -m 'not real' $(NUMERICAL) tests/data tests/io

check: $(VENV)/.installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: $(VENV)/.installed
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# The page of docs that is made from docstrings, and the tables of settings and formats.
docs: $(VENV)/.installed
	$(BIN)/python docs/make_api.py
	$(BIN)/python docs/make_tables.py

# The pages of the repository as a site, in build/site: links and their places are checked, and nothing
# in it is loaded from elsewhere. To look at it: python -m http.server -d build/site
SHOWN := README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md CITATION.cff LICENSE docs data experiments

site: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs]'
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	mkdir -p build/pages
	ln -sfn $(addprefix $(CURDIR)/,$(SHOWN)) build/pages
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

build/clean/.made: pyproject.toml constraints.txt
	rm -rf build/clean
	$(PYTHON) -m venv build/clean
	touch $@

# A source distribution, the wheel that it builds, and a take that goes the whole way with the wheel
# in an environment of its own.
dist: $(VENV)/.installed build/clean/.made
	rm -rf dist
	$(BIN)/python -m pip install --quiet --constraint constraints.txt build
	PIP_CONSTRAINT=$(CURDIR)/constraints.txt $(BIN)/python -m build --outdir dist
	build/clean/bin/python -m pip install --quiet --constraint constraints.txt dist/*.whl
	build/clean/bin/python -m pip install --quiet --force-reinstall --no-deps dist/*.whl
	build/clean/bin/python -m pip check
	build/clean/bin/python -I .ci/wheel.py dist/*.tar.gz dist/*.whl

bench: $(VENV)/.installed
	$(BIN)/python -m experiments.bench
	$(BIN)/python -m experiments.bench.topology

# Small changes of the mathematics: a test must notice each.
mutants: $(VENV)/.installed
	$(BIN)/python -m experiments.mutants

# All readers under atheris; findings go to tests/fuzz/findings, where the tests take them up.
fuzz: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[fuzz]'
	$(BIN)/python -m experiments.fuzz --minutes $(MINUTES)

# Both need the real recordings (FACERT_DATA), take their time, and continue where they stopped.
figures: $(VENV)/.installed
	$(BIN)/python -m experiments.figures

acceptance: $(VENV)/.installed
	$(BIN)/python -m experiments.default
	$(BIN)/python -m experiments.default --split block
	$(BIN)/python -m experiments.default --split across

clean:
	rm -rf build $(VENV)
