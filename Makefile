PYTHON ?= python3
BIN := .venv/bin
SCENE := assets/scenes/assignment.toml

GL_PACKAGES := libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri
# libatomic1: Dr.Jit, on which Mitsuba is built, loads it.
TEST_PACKAGES := $(GL_PACKAGES) ?libosmesa6 libglx-mesa0 libatomic1 xvfb xdotool ?povray ?openimageio-tools

# `make test` runs these tests again on OSMesa: tests of OpenGL itself, and of pictures.
ON_OSMESA := tests/gpu tests/rendering/test_picture.py
# `make check` does not run these tests again on OSMesa: they test values of shaders, which do not depend on the backend.
ONCE := test_pages.py analysis ground_truth scene/test_merl.py compiler/test_soft_cells.py \
	$(patsubst %,rendering/test_%.py,article brdf brdf_rough estimator mirrors peers soft)

.PHONY: demo test view check extremes bench pictures clean help
.DELETE_ON_ERROR:
.NOTPARALLEL:

demo: .venv/core ## render the assignment to assignment.png (the default)
	@tools/system-packages $(GL_PACKAGES)
	$(BIN)/raytracer render $(SCENE) -o assignment.png --samples 16

test: .venv/dev ## run all tests except slow ones on EGL, then some again on OSMesa
	$(call run_tests,-m 'not slow',-m 'gl and not slow' $(ON_OSMESA))

# Tests run in one process for each core, up to 4: every process has its own OpenGL context, which has threads for all
# cores. The tests of one file stay in one process, because they share fixtures.
PYTEST := $(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist loadfile

# $(call run_tests,SELECTION ON EGL,SELECTION ON OSMESA)
define run_tests
	@tools/system-packages $(patsubst ?%,'?%',$(TEST_PACKAGES))
	@if dpkg -s libosmesa6 >/dev/null 2>&1; then \
		set -ex; \
		RAYTRACER_BACKEND=egl $(PYTEST) $(1); \
		RAYTRACER_BACKEND=osmesa $(PYTEST) $(2); \
	else \
		echo 'The package libosmesa6 is not available: the OpenGL tests do not run again on OSMesa.'; \
		RAYTRACER_TEST_BACKENDS='egl window' RAYTRACER_BACKEND=egl $(PYTEST) $(1); \
	fi
endef

view: .venv/core ## open the assignment in a window
	@tools/system-packages $(GL_PACKAGES) libglx-mesa0
	$(BIN)/raytracer view $(SCENE)

check: .venv/dev ## check style, formatting, types and import rules, then run all tests on EGL, and many again on OSMesa
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(call run_tests,,-m 'gl and not slow' $(addprefix --ignore tests/,$(ONCE)))

extremes: .venv/core ## measure errors at the extremes of all inputs, into benchmarks/results
	@tools/system-packages $(GL_PACKAGES)
	$(BIN)/raytracer extremes -o benchmarks/results

bench: .venv/core ## measure the speed, also against POV-Ray, into benchmarks/results and docs/performance.md
	@tools/system-packages $(GL_PACKAGES) '?povray'
	$(BIN)/python -m benchmarks.speed -o benchmarks/results --docs

pictures: .venv/dev ## make the pictures of the README, the tutorial and the reflectance models
	@tools/system-packages $(GL_PACKAGES) libglx-mesa0 xvfb xdotool
	$(BIN)/python -m tools.pictures
	$(BIN)/raytracer brdf gallery -o assets/gallery.png

clean: ## remove all generated files
	rm -rf .venv build dist .pytest_cache .ruff_cache assignment.png
	find . -name __pycache__ -prune -exec rm -rf {} +

help: ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | expand -t 8

# Stamp files of the installed packages: a repeated run installs nothing, a changed pyproject.toml installs again.
.venv/core: pyproject.toml | .venv/bin/pip
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/dev: pyproject.toml | .venv/bin/pip
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,plots,peers,flip]'
	@touch .venv/core $@

# Debian has a separate package for virtual environments of each Python. The packages of `make demo` are requested
# together with it, so that users who are not root have to run one command, not two.
.venv/bin/pip:
	@command -v $(PYTHON) >/dev/null || tools/system-packages python3
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("$(PYTHON) is Python %d.%d, \
	and 3.11 or later is needed. To use another: make PYTHON=python3.11" % sys.version_info[:2])'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
		tools/system-packages $(GL_PACKAGES) \
			"$$($(PYTHON) -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')"
	$(PYTHON) -m venv .venv
