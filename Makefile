# Targets set up what they need: an environment in .venv/ of this clone and, when run as root on
# a Debian-like system, the few system libraries that Sionna RT and Blender load.
SHELL := /bin/bash
PYTHON ?= python3.11
VENV := .venv/bin
READY := .venv/.ready
KERNELS := .venv/.kernels
# A machine with only `python3` is fine as long as that is Python 3.11.
PYTHON_FOUND := $(shell command -v $(PYTHON) || command -v python3)

# As `rfgs_core` sets it for programs; pytest's plugins load numpy before that.
export OPENBLAS_NUM_THREADS ?= 1

# Hundreds of processes and both workers of pytest load the same modules: they are compiled once.
unexport PYTHONDONTWRITEBYTECODE

# Commands take pip's Blender: one of the reader's own may lack the add-on. Only test-blender asks for it.
unexport BLENDER

# Tests side by side: each worker takes one half of them, and then from what is left to the other, so
# that neighbours, which share what is costly to set up, stay together.
WORKERS ?= 2

.PHONY: setup demo test test-slow test-blender test-bpy test-wheel docs example release lint format sync system clean

setup: $(KERNELS)

demo: $(KERNELS)
	$(VENV)/rfgs demo --out demo

test: $(KERNELS)
	$(VENV)/pytest -m "not slow and not blender" -n $(WORKERS) --dist worksteal tests

test-slow: $(KERNELS)
	$(VENV)/pytest -m "slow and not blender" tests

test-blender: $(READY) system
	BLENDER="$(BLENDER)" bash .ci/test_blender.sh

test-bpy: $(READY) system
	bash .ci/test_bpy.sh

# An environment of its own: the wheel without extras, and so without Blender and Sionna RT.
test-wheel:
	PYTHON=$(PYTHON_FOUND) bash .ci/test_wheel.sh

# The site below site/. A link or a name of the API that leads nowhere ends it.
docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(VENV)/mkdocs build --strict --quiet

# The small dataset and run that come with the package (rfgs_core/example.zip), made anew. A quarter
# of Wi-Fi's subcarriers and few, small pictures keep it below 3 MB.
example: $(READY) system
	rm -rf example && mkdir example
	$(VENV)/rfgs-factory radios wifi | sed -e 's/^name:.*/name: small_wifi/' -e 's/^num_subcarriers:.*/num_subcarriers: 16/' > example/radio.yaml
	$(VENV)/rfgs-factory generate living_room_walk --radio example/radio.yaml --frames 10:42:8 --cameras 2 --resolution 96 --samples 12 --out example/dataset
	$(VENV)/rfgs train example/dataset --radio small_wifi --gaussians 1000 --out example/run
	$(VENV)/rfgs eval example/run --no-oracle
	$(VENV)/rfgs pose example/run
	$(VENV)/python -m rfgs_core.example example

# What a release consists of, below dist/: the wheel, the extension for Blender, and their digests.
release: $(READY)
	rm -rf dist
	$(VENV)/python -m pip wheel --quiet --no-deps --wheel-dir dist .
	$(VENV)/rfgs addon build --out dist
	cd dist && sha256sum *.whl *.zip > SHA256SUMS && cat SHA256SUMS

lint: $(READY)
	$(VENV)/ruff check .
	$(VENV)/ruff format --check .
	$(VENV)/pyright

format: $(READY)
	$(VENV)/ruff check --fix .
	$(VENV)/ruff format .

sync: $(READY)
	$(VENV)/python -m rfgs_core.sync

system:
	@bash .ci/system_libraries.sh

$(READY): pyproject.toml constraints.txt
	@$(PYTHON_FOUND) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || { \
	  echo "error: Python 3.11 is needed (bpy 4.5 has no wheels for others); found $$($(PYTHON_FOUND) --version 2>&1). Install it, or run: make PYTHON=/path/to/python3.11 ..."; exit 2; }
	$(PYTHON_FOUND) -m venv .venv
	$(VENV)/python -m pip install --quiet --upgrade pip
	@echo "Installing the pinned packages (about 4 GB on disk, several minutes) ..."
	$(VENV)/python -m pip install --quiet --constraint constraints.txt --editable ".[dev]"
	@touch $(READY)

# Once, so that neither the first run nor each of its workers waits for compilers.
$(KERNELS): $(READY) | system
	@echo "Compiling kernels once (some three minutes) ..."
	@bash .ci/compile_kernels.sh $(VENV)
	@touch $(KERNELS)

clean:
	rm -rf .venv .blender demo site
