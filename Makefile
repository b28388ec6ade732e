# What people do with this workspace, by name; `make` alone lists it.
# These targets stand on the ROS 2 wheels in .venv. With a ROS 2 installation use colcon and ros2 instead.

PYTHON ?= python3

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory --no-builtin-rules

VENV := .venv
DIST ?= dist
BIN := $(VENV)/bin
BUILD_TOOLS := ^(setuptools|wheel|packaging)==
PACKAGES := $(addprefix src/fivebar_,description control sim bringup)

export PIP_DISABLE_PIP_VERSION_CHECK := 1
# A sourced ROS installation must not mix with the wheels, nor must another environment of wheels; the last of these
# says that the library path is already set, which holds for one environment only.
unexport PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH
# Hundreds of processes start in a test run: the first of them keeps what it has compiled.
unexport PYTHONDONTWRITEBYTECODE
unexport ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION _ROS_WHEELS_BOOTSTRAP_COMPLETE

.PHONY: help
help: ## list these targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 18

.PHONY: setup
setup: $(VENV)/packages.stamp ## make .venv with every locked package and the workspace in it

.PHONY: crossing
crossing: setup ## run the middle trajectory through the singularity; results under runs/
	@$(BIN)/fivebar run middle

.PHONY: reproduce
reproduce: setup ## make the figures and claims of the thesis again, a few minutes; results under runs/
	@$(BIN)/fivebar reproduce

# the files with tests that follow the clock; to import all the others takes ten seconds
CLOCK = $(shell grep -rl --include='test_*.py' 'mark\.clock' tests/ros tests/system)

.PHONY: test
test: setup ## run the tests
	@# five at a time on two processors, because half of the tests wait for nodes (tests/conftest.py has the order); what
	# follows the clock by itself, one after the other, and also where the others have failed; machine code is optimised
	# less, which takes a quarter off its compilation, and kept apart from what users run and the long tests test
	status=0
	export NUMBA_OPT=1 NUMBA_CACHE_DIR=$(CURDIR)/.numba
	$(BIN)/python -m pytest tests src -q -n 5 --dist loadfile --no-loadscope-reorder -m "not clock and not extra" --durations=10 || status=$$?
	$(BIN)/python -m pytest $(CLOCK) -q -m "clock and not extra" --durations=10 || status=$$?
	exit $$status

.PHONY: test-extra
test-extra: setup ## run what test leaves out: long tests of the studies, and pages in Chromium if it is installed
	@# RENEW_SCREENSHOTS=1 writes the documentation's pictures of pages instead of comparing with them
	[ -d .browser ] || $(BIN)/pip install --quiet --no-deps --target .browser -r tests/browser/requirements.lock
	[ -d .docs ] || $(BIN)/pip install --quiet --no-deps --target .docs -r docs/site/requirements.lock
	[ -d .cluster ] || $(BIN)/pip install --quiet --no-deps --target .cluster -r tests/cluster/requirements.lock
	[ -d .vendors ] || $(BIN)/pip install --quiet --no-deps --target .vendors -r tests/vendors/requirements.lock
	status=0
	export PYTHONPATH=$(CURDIR)/.browser:$(CURDIR)/.docs:$(CURDIR)/.vendors:$(CURDIR)/.cluster
	$(BIN)/python -m pytest tests -q -n 2 --dist loadfile --no-loadscope-reorder -m "extra and not clock" --durations=10 || status=$$?
	$(BIN)/python -m pytest $(CLOCK) -q -m "clock and extra" --durations=10 || status=$$?
	exit $$status

.PHONY: docs
docs: setup ## build the documentation site into site/; a broken link is an error
	@[ -d .docs ] || $(BIN)/pip install --quiet --no-deps --target .docs -r docs/site/requirements.lock
	PYTHONPATH=.docs NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --clean
	echo "docs: look at site/index.html; its search needs a server: python3 -m http.server --bind 127.0.0.1 --directory site"

.PHONY: extras
extras: setup ## install what no other target needs into .venv: Dask, for studies on a cluster
	@# in the versions of its lock, but what .venv has in its own
	sed -nE 's/^([A-Za-z0-9_.-]+)==.*/^\1==/p' requirements.lock | grep -vi -f - tests/cluster/requirements.lock \
	    | $(BIN)/pip install --quiet --no-deps -r /dev/stdin
	echo "extras: fivebar takes --scheduler; start a scheduler with $(BIN)/dask scheduler --host 127.0.0.1"

.PHONY: notebook
notebook: setup ## open the tutorials that are notebooks in JupyterLab, for this machine alone
	@[ -d .notebook ] || $(BIN)/pip install --quiet --no-deps --target .notebook -r docs/site/notebook.lock
	PYTHONPATH=.notebook JUPYTER_PATH=.notebook/share/jupyter $(BIN)/python -m jupyterlab --ip=127.0.0.1 \
	    --app-dir=.notebook/share/jupyter/lab --notebook-dir=docs/tutorials $(OPTIONS)

.PHONY: results
results: setup ## make the page in docs/results again, in some hours: make results OPTIONS="--only robustness" are some
	@$(BIN)/python docs/studies/make_result_pages.py --out docs/results $(OPTIONS)

.PHONY: play
play: setup ## write docs/play.html again, the page with the model in JavaScript
	@$(BIN)/fivebar play --no-open --out docs/play.html

.PHONY: lint
lint: setup ## check style, types and the licence in source files
	@$(BIN)/ruff check
	$(BIN)/ruff format --check --quiet
	$(BIN)/mypy
	$(BIN)/python packaging/spdx.py --check

.PHONY: mutants
mutants: setup ## break the core in small ways and list what no unit test notices; long, so not part of test
	@# MODULES=laws/unified or MODULES="model laws" is a part of it, SAMPLE=400 that many of all at random, SEED=7 others;
	@# tests/mutants/README.md has what is known to be left
	[ -d .mutants ] || $(BIN)/pip install --quiet --no-deps --target .mutants -r tests/mutants/requirements.lock
	PYTHONPATH=.mutants OPENBLAS_NUM_THREADS=1 $(BIN)/python -u tests/mutants/run.py $(MODULES) \
	    $(if $(SAMPLE),--sample $(SAMPLE) --seed $(or $(SEED),0))

.PHONY: fuzz
fuzz: setup ## feed every parser random input: make fuzz INPUTS=1000000; a short run is part of test
	@# PARSERS="scenario bag" is a part of it; an input that fails is kept in .fuzz/, beside those that reach new code,
	@# from which the next run begins
	[ -d .fuzz/packages ] || $(BIN)/pip install --quiet --no-deps --target .fuzz/packages -r tests/fuzz/requirements.lock
	PYTHONPATH=.fuzz/packages OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/fuzz/run.py $(PARSERS) --inputs $(or $(INPUTS),20000)

.PHONY: walks
walks: setup ## count the files and functions that data passes on four ways through the code
	@$(BIN)/python tests/support/walking.py $(WALKS)

.PHONY: reach
reach: setup ## count the files, lines and functions that commands and nodes load and execute
	@$(BIN)/python tests/support/reach.py $(REACH)

.PHONY: bench
bench: setup ## measure speed on this machine
	@$(BIN)/python bench

.PHONY: bench-realtime
bench-realtime: setup ## repeat runs in real time on this machine; RUNS=40 KINDS="middle kilohertz" are a choice of them
	@$(BIN)/python bench/series.py $(RUNS) $(KINDS)

.PHONY: build
build: setup ## build the packages as colcon does, into build/ install/ log/
	@$(BIN)/colcon build --base-paths src

.PHONY: dist
dist: setup ## build wheels of the four packages and of `fivebar`, which needs them, into dist/
	@work=$$(mktemp -d)
	trap 'rm -rf "$$work"' EXIT
	# from a copy, because setuptools leaves its own copies of the modules where it builds
	cp -r --parents $(PACKAGES) packaging requirements.in docs/index.md "$$work"
	rm -rf $(DIST) "$$work"/src/*/build
	$(BIN)/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir $(DIST) \
	    $(addprefix "$$work"/,$(PACKAGES) packaging)
	ls $(DIST)

.PHONY: archive
archive: setup ## pack a reproduction for Zenodo: make archive REPRODUCTION=runs/reproduce-...; without, it is made first
	@directory="$(REPRODUCTION)"
	if [ -z "$$directory" ]; then
	    directory=runs/reproduce-$$(date +%Y%m%d-%H%M%S)
	    $(BIN)/fivebar reproduce --out "$$directory"
	fi
	version=$$(sed -n 's/^version: //p' CITATION.cff)
	mkdir -p $(DIST)
	$(BIN)/python packaging/archive.py "$$directory" "$(DIST)/fivebar-reproduction-$$version.zip"

.PHONY: audit
audit: setup ## look up the locked packages in the database of known weaknesses; 3 if it cannot be reached
	@[ -d .audit ] || $(BIN)/pip install --quiet --target .audit pip-audit==2.10.1
	PYTHONPATH=.audit $(BIN)/python packaging/audit.py

.PHONY: version
version: ## set the version of all packages, dated today: make version NEW=1.2.3
	@[[ "$(NEW)" =~ ^[0-9]+\.[0-9]+\.[0-9]+$$ ]] || { echo "version: expected NEW=1.2.3" >&2; exit 1; }
	today=$$(date +%F)
	sed -i 's|<version>.*</version>|<version>$(NEW)</version>|' $(PACKAGES:=/package.xml)
	sed -i "s|^version: .*|version: $(NEW)|; s|^date-released: .*|date-released: $$today|" CITATION.cff
	grep -qF "## [$(NEW)]" CHANGELOG.md || sed -i "s|^## \[Unreleased\]$$|&\n\n## [$(NEW)] - $$today|" CHANGELOG.md

.PHONY: publishable
publishable: ## refuse to publish with a maintainer or a url that is a placeholder
	@if grep -HnF 'example.org' $(PACKAGES:=/package.xml) >&2; then
	    echo "publishable: maintainer and url are placeholders: enter those of the project in these lines first" >&2
	    exit 1
	fi

.PHONY: lock
lock: setup ## resolve requirements.in again into all lock files, with the newest versions: make lock LOCKS="lowest jazzy" are some
	@[ -x .uv/bin/uv ] || { "$(PYTHON)" -m venv .uv && .uv/bin/pip install --quiet uv==0.13.9; }
	$(BIN)/python packaging/locks.py .uv/bin/uv --upgrade $(LOCKS)

.PHONY: hashes
hashes: setup ## write requirements.hashed.lock, the digests of what requirements.lock names
	@$(BIN)/python packaging/hashes.py

# A unit test needs neither the graph nor the clock, and the units are where versions of numpy and of others differ.
UNITS = NUMBA_OPT=1 NUMBA_CACHE_DIR=$(CURDIR)/$(1)/numba $(1)/bin/python -m pytest tests/unit src -q -n 2 -p no:cacheprovider -m "not extra"
INTO = $(1)/bin/pip install --quiet --no-compile
WORKSPACE = --no-deps --no-build-isolation --use-pep517 --config-settings editable_mode=compat $(addprefix --editable ,$(PACKAGES))

.PHONY: test-lowest
test-lowest: ## run the unit tests on the lowest versions of all dependencies; PYTHON is a 3.11 or a 3.12
	@version=$$("$(PYTHON)" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
	lock=packaging/lowest-$$version.lock
	[ -f "$$lock" ] || { echo "test-lowest: $$lock is not there; name another Python with PYTHON=..." >&2; exit 2; }
	environment=.lowest-$$version
	"$(PYTHON)" -m venv --clear $$environment
	grep -A1 -E '$(BUILD_TOOLS)' "$$lock" | grep -v '^--$$' > $$environment/build_tools.lock
	$(call INTO,$$environment) --no-deps --require-hashes -r $$environment/build_tools.lock
	$(call INTO,$$environment) --no-deps --no-build-isolation --require-hashes -r "$$lock"
	$(call INTO,$$environment) $(WORKSPACE)
	$(call UNITS,$$environment)

.PHONY: test-newest
test-newest: ## run the unit tests on the newest versions of all dependencies, whatever requirements.lock names
	@"$(PYTHON)" -m venv --clear .newest
	$(call INTO,.newest) --upgrade pip
	$(call INTO,.newest) -r requirements.in
	$(call INTO,.newest) $(WORKSPACE)
	$(call UNITS,.newest)

.PHONY: try-jazzy
try-jazzy: ## try the way for ROS 2 Jazzy in a fresh Debian made by debootstrap, for root: make try-jazzy ROOT=/tmp/debian
	@packaging/try_jazzy.sh $(ROOT)

.PHONY: clean
clean: ## remove whatever can be made again; runs/ stays
	@rm -rf $(VENV) .jazzy .lowest-* .newest .uv .audit .browser .docs .notebook .vendors .cluster .mutants .numba site dist build install log .mypy_cache .pytest_cache .ruff_cache .hypothesis .fuzz
	find src tests docs bench -name __pycache__ -prune -exec rm -rf {} + -o -name '*.egg-info' -prune -exec rm -rf {} +

# Two stamps: a new lock makes .venv afresh, so that nothing stays in it that the lock does not name; a new setup.py
# only reinstalls the workspace.
$(VENV)/lock.stamp: requirements.hashed.lock
	@refuse() { echo "setup: $$*" >&2; exit 1; }
	command -v "$(PYTHON)" >/dev/null || refuse "$(PYTHON) not found; name a Python 3.11, 3.12 or 3.13 with PYTHON=..."
	facts='import platform as p; print(*p.python_version_tuple()[:2], p.system(), p.machine(), sep="-")'
	found=$$("$(PYTHON)" -c "$$facts" 2>/dev/null) \
	    || refuse "$(PYTHON) does not run; name a Python 3.11, 3.12 or 3.13 with PYTHON=..."
	case $$found in
	    3-1[123]-Linux-x86_64) ;;
	    *-Linux-x86_64) refuse "Python 3.11, 3.12 or 3.13 is needed, $(PYTHON) is not; name another with PYTHON=..." ;;
	    *) refuse "ROS 2 wheels exist for x86-64 Linux only; here use a ROS 2 Jazzy installation and colcon (README)" ;;
	esac
	"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null \
	    || refuse "$(PYTHON) lacks the venv module; on Debian and Ubuntu: apt install python3-venv"
	echo "setup: making $(VENV) with $$("$(PYTHON)" --version)"
	"$(PYTHON)" -m venv --clear $(VENV)
	echo "setup: installing the locked packages, a minute or two"
	# what is never imported need not be compiled, and that is most of it; the lock is complete, which a check is faster
	# to find than a resolver
	# first the tools that build source distributions, which then nothing replaces while they build
	parts=$$(mktemp -d)
	trap 'rm -rf "$$parts"' EXIT
	install() { $(BIN)/pip install --quiet --no-compile --no-deps --no-build-isolation --require-hashes -r "$$1"; }
	grep -vE '^#' requirements.hashed.lock | sed ':a; /\\$$/{N; s/ *\\\n */ /; ba}' > "$$parts/all"
	grep -E '$(BUILD_TOOLS)' "$$parts/all" > "$$parts/tools"
	install "$$parts/tools"
	# two at a time, because unpacking keeps a processor busy
	grep -vE '$(BUILD_TOOLS)' "$$parts/all" | split --number=r/2 - "$$parts/half."
	for part in "$$parts"/half.*; do install "$$part" & installers+=($$!); done
	for installer in "$${installers[@]}"; do wait "$$installer"; done
	$(BIN)/pip check >/dev/null || refuse "requirements.hashed.lock is not complete: $$($(BIN)/pip check)"
	touch $@

# `compat` puts the source folders on the path as they are, where type checkers and editors find them too.
$(VENV)/packages.stamp: $(VENV)/lock.stamp $(PACKAGES:=/setup.py) $(PACKAGES:=/setup.cfg) $(PACKAGES:=/package.xml)
	@echo "setup: installing the workspace"
	$(BIN)/pip install --quiet --no-deps --no-build-isolation --use-pep517 --config-settings editable_mode=compat \
	    $(addprefix --editable ,$(PACKAGES))
	touch $@
