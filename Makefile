# Every task of the repository. `make figures` and `make test` start from Rust, Python >= 3.11 and
# make alone: they create .venv, build the extension in release mode and install what they need,
# `make figures` no more than the package itself. Stamp files in .venv make later calls quick; a
# change of src/ or of a manifest builds again.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:

# The first interpreter that will do; `make PYTHON=/path/to/python3` overrides.
IS_USABLE := import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c '$(IS_USABLE)' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
OUT ?= figures
# Where wheels and sdists go.
DIST ?= dist

BIN := $(abspath $(VENV))/bin
# One interpreter for every build of the bindings, or cargo would rebuild them at each change.
export PYO3_PYTHON := $(BIN)/python
# The tests draw, but not on a screen.
export MPLBACKEND ?= Agg

TOOLS := $(VENV)/.tools
# The package; the reproduction of the paper beside it; with what tests and lint need on top; with what the site needs on top of that.
PACKAGE := $(VENV)/.package
REPRODUCTION := $(VENV)/.reproduction
INSTALLED := $(VENV)/.installed
SITE_TOOLS := $(VENV)/.site-tools
RUST := $(shell find src -name '*.rs' -o -type d) Cargo.toml Cargo.lock

.PHONY: help figures claims gallery errata schematic words pictures notebook animation test reference lint bench instructions instructions-update stress docs ci audit clean
.PHONY: tools lint-rust lint-python test-browser quick quick-update thorough wheel wheel-test audit-deps fuzz fuzz-python

help:
	@echo 'make figures  draw the figures of the paper and write the table of claims into $(OUT)/'
	@echo 'make claims   judge every statement of the paper and write docs/claims.md'
	@echo 'make gallery  draw the pictures of docs/gallery.md'
	@echo 'make errata   draw the figures of docs/errata.md'
	@echo 'make schematic  draw the machine, into docs/images'
	@echo 'make words    draw the sketches of docs/words.md'
	@echo 'make pictures  draw the other pictures of the documentation: two pages of figures, the explorer'
	@echo 'make notebook  write docs/tutorial.ipynb from docs/tutorial.md'
	@echo 'make animation  draw a motion that moves, into docs/images'
	@echo 'make test     all tests: Rust, documentation, Python'
	@echo 'make test-browser  the explorer in headless Chromium (packages chromium, chromium-driver)'
	@echo 'make quick    those for the change at hand: unit tests in Rust, and what is not slow in Python'
	@echo 'make quick-update  measure anew which tests are slow (tests/slow.txt)'
	@echo 'make thorough  make test with all that random tests can draw, then make reference, audit and fuzz'
	@echo 'make reference  make the reference data anew, in high precision, and compare with what is committed'
	@echo 'make lint     formatting, lints, types, stubs, purity of the core, documentation'
	@echo 'make bench    all benchmarks: criterion, the bars, savings, run time against error beside other solvers'
	@echo 'make instructions  instruction counts of the hot kernels against the committed ones (valgrind)'
	@echo 'make stress   errors at the ends of every range, and over very long runs'
	@echo 'make audit    a million random flights, and as many of structures, against an independent dense search; 10,000 runs of structures'
	@echo 'make fuzz     coverage-guided fuzzing of the Rust library; RUNS= and SECONDS_EACH= for each target, TARGETS='
	@echo 'make fuzz-python  a hundred thousand calls from Python with any arguments, guided by coverage; RUNS=... for more'
	@echo 'make docs     build the documentation site, Python and Rust reference included, into site/'
	@echo 'make wheel    a wheel for Linux, an sdist and the wheel of the reproduction into $(DIST)/, with their sizes'
	@echo 'make wheel-test  wheel and sdist installed in fresh environments, the wheel without Rust, and tested there'
	@echo 'make audit-deps  licences, sources and duplicates of the dependencies; ADVISORIES=yes: known weaknesses too'
	@echo 'make ci       what continuous integration runs: lint, docs, test, instructions'
	@echo 'make clean    remove what the other targets have made'

figures: $(PACKAGE) $(REPRODUCTION)
	$(BIN)/vibroimpact reproduce --out $(OUT)

claims: $(PACKAGE) $(REPRODUCTION)
	$(BIN)/vibroimpact claims --markdown docs/claims.md

# Without the file that they share, which is no script.
GALLERY := $(filter-out %/picture.py,$(wildcard examples/gallery/*.py))

gallery: $(PACKAGE)
	@for script in $(GALLERY); do \
		$(BIN)/python $$script --out docs/images/gallery/$$(basename $$script .py).png; \
	done

ERRATA := $(filter-out __main__,$(basename $(notdir $(wildcard examples/errata/*.py))))

errata: $(PACKAGE) $(REPRODUCTION)
	@for name in $(ERRATA); do \
		$(BIN)/python examples/errata $$name --out docs/images/errata/$$name.png; \
	done

schematic: $(PACKAGE)
	$(BIN)/python examples/schematic.py --out docs/images/schematic.png

words: $(PACKAGE)
	$(BIN)/python examples/words.py --out docs/images/words

# That of the explorer needs Debian's packages chromium and chromium-driver.
PICTURES := fig7c-contact fig8-regimes explorer explorer-structure

pictures: $(INSTALLED)
	@for name in $(PICTURES); do \
		$(BIN)/python examples/pictures.py $$name --out docs/images/$$name.png; \
	done

notebook: $(TOOLS)
	$(BIN)/python docs/executed.py

animation: $(PACKAGE)
	$(BIN)/python examples/animation.py --out docs/images/animation.gif

# In as many processes as there are processors, each with a part of the files, so that tests of one
# file share fixtures; a process that has done its part takes over some of another's.
IN_PARALLEL ?= -n auto --dist worksteal
# Or each of the interpreters that tests start would compile the package anew.
test quick quick-update: export PYTHONDONTWRITEBYTECODE :=

test: | rust-tests-begun $(INSTALLED)
	@waits=0; while kill -0 "$$(cat $(RUST_TESTS).pid)" 2>/dev/null; do \
		sleep 0.2; waits=$$((waits + 1)); \
		test $$((waits % 50)) -ne 0 || { echo -n "Rust tests, after $$((waits / 5)) s: "; \
			tail -n 1 $(RUST_TESTS).log | cut -c -60; }; \
	done
	@cat $(RUST_TESTS).log && test -e $(RUST_TESTS).passed
	$(BIN)/python -m pytest $(IN_PARALLEL) $(PYTEST)

# The tests in Rust are built and run while the environment is built, which is mostly waiting for pip
# and for the linker of the extension. Their output follows when both are done.
RUST_TESTS := target/rust-tests
.PHONY: rust-tests-built rust-tests-begun
rust-tests-built: | check-tools
	cargo test --locked --lib --tests --no-run

rust-tests-begun: | check-tools
	@mkdir -p target && rm -f $(RUST_TESTS).passed
	@echo 'Rust tests: built and run in the background, output follows ($(RUST_TESTS).log)'
	@(cargo test --locked --lib --tests && cargo test --locked --doc && touch $(RUST_TESTS).passed) \
		>$(RUST_TESTS).log 2>&1 & echo $$! >$(RUST_TESTS).pid

# In a real browser: needs Debian's packages chromium and chromium-driver. A part of `make test`, too,
# which skips these tests where there is no browser.
test-browser: $(INSTALLED)
	$(BIN)/python -m pytest tests/python/test_explorer_browser.py -v $(PYTEST)

quick: $(INSTALLED)
	cargo test --locked --lib
	$(BIN)/python -m pytest --quick $(IN_PARALLEL) $(PYTEST)

quick-update: $(INSTALLED)
	$(BIN)/python -m pytest --record-slow

thorough: export VIBROIMPACT_THOROUGH := yes
thorough: test reference audit fuzz

# The supplied data are computed anew, too, and must lie within a unit of their last digits.
reference: $(INSTALLED)
	cd tests && $(BIN)/python -m reference.supplied
	cd tests && $(BIN)/python -m reference.regenerate

lint: lint-rust lint-python

# The bindings are a part of the library alone, which nothing else that is compiled here names. The
# bindings need an interpreter, for its version. The fuzz targets share what has been compiled.
lint-rust: | $(TOOLS)
	@cargo fmt --version >/dev/null && cargo clippy --version >/dev/null \
		|| { echo 'make lint needs rustfmt and clippy: rustup component add rustfmt clippy'; exit 1; }
	cargo fmt --check
	cargo clippy --locked --all-targets -- -D warnings
	cargo clippy --locked --lib --all-features -- -D warnings
	cargo check --locked --manifest-path fuzz/Cargo.toml \
		--target-dir $${CARGO_TARGET_DIR:-target} --config profile.dev.opt-level=1
	RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps
	@echo 'purity: the core names neither pyo3 nor numpy'
	@tree=$$(cargo tree --locked -e normal --prefix none); ! grep -E '^(pyo3|numpy)' <<<"$$tree"
	@! grep -rnwE 'pyo3|numpy' src --include='*.rs' --exclude-dir=python --exclude=python.rs

lint-python: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest vibroimpact._core

bench: $(INSTALLED)
	$(BIN)/python benches/install_peers.py
	cargo bench --locked
	$(BIN)/python benches/bars.py
	$(BIN)/python benches/savings.py
	$(BIN)/python benches/labels.py
	$(BIN)/python benches/sensitivity.py
	cargo run --release --locked --example robust_labels -- --every 10 --systems 400
	$(BIN)/python benches/work_precision
	$(BIN)/python benches/structures
	@echo 'results are in benches/out and benches/work_precision/out'

# Need no more than Rust, a C compiler, valgrind and any Python.
instructions: | check-tools
	$(PYTHON) benches/instructions.py

instructions-update: | check-tools
	$(PYTHON) benches/instructions.py --update

stress: $(INSTALLED)
	$(BIN)/python benches/stress

audit:
	cargo run --locked --release --example contact_audit
	cargo run --locked --release --example contact_audit -- --structures by-modes --flights 500000
	cargo run --locked --release --example contact_audit -- --structures coupled --flights 500000
	VIBROIMPACT_THOROUGH=yes cargo test --locked --release --test integration -- --nocapture --exact \
		structure_runs::random_structures_end_for_a_reason_and_explain_their_energy

# Needs no more than Rust, a C++ compiler and any Python.
RUNS ?= 100000
SECONDS_EACH ?= 60

fuzz: | check-tools
	$(PYTHON) fuzz/run.py --runs $(RUNS) --seconds $(SECONDS_EACH) $(TARGETS)

fuzz-python: $(INSTALLED)
	$(BIN)/python -m pip install --quiet atheris
	$(BIN)/python fuzz/python/entry.py --runs $(RUNS)

# From nothing each time, or pages that are no more would stay.
docs: $(SITE_TOOLS)
	RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps
	rm -rf site
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet --fresh-env --write-all \
		--conf-dir docs --doctree-dir $(VENV)/.doctrees . site
	cp -R $${CARGO_TARGET_DIR:-target}/doc site/rust
	$(BIN)/python docs/check_links.py site
	@echo 'the documentation is in site/index.html'

# Zig links against the oldest glibc that Rust itself supports; maturin audits the result.
WHEEL_OPTIONS ?= --zig --compatibility manylinux_2_17

wheel: $(TOOLS)
	$(BIN)/python -m pip install --quiet 'maturin[zig]>=1.16,<2'
	rm -f $(DIST)/vibroimpact-*.whl $(DIST)/vibroimpact-*.tar.gz $(DIST)/han_jin_hu_2004-*.whl
	PATH=$(BIN):$$PATH maturin build --release --locked $(WHEEL_OPTIONS) --out $(DIST)
	$(BIN)/maturin sdist --out $(DIST)
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir $(DIST) ./reproduction
	$(BIN)/python packaging/check_dist.py $(DIST)

wheel-test: wheel
	$(PYTHON) packaging/try_installed.py $(DIST)/vibroimpact-*.whl $(DIST)/han_jin_hu_2004-*.whl --tests $(DIST)/*.tar.gz -- $(IN_PARALLEL) $(PYTEST)
	$(PYTHON) packaging/try_installed.py $(DIST)/*.tar.gz $(DIST)/han_jin_hu_2004-*.whl --tests $(DIST)/*.tar.gz -- $(IN_PARALLEL) $(PYTEST)

audit-deps: $(TOOLS)
	@cargo deny --version 2>/dev/null || { echo 'cargo-deny is needed: cargo install --locked cargo-deny'; exit 1; }
	cargo deny --locked check licenses bans sources
ifdef ADVISORIES
	cargo deny --locked check advisories
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit --strict .
endif

ci:
	.ci/run

clean:
	rm -rf $(VENV) $(OUT) $(DIST) site jupyter_execute target benches/.build benches/out benches/work_precision/out benches/stress/out
	rm -rf fuzz/out fuzz/target
	rm -rf .hypothesis .mypy_cache .pytest_cache .ruff_cache
	rm -f python/vibroimpact/_core.*.so python/vibroimpact/_core.pyd
	find python reproduction tests benches -name __pycache__ -type d -prune -exec rm -rf {} +

tools: $(TOOLS)

$(TOOLS): | check-tools
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip 'maturin>=1.16,<2' 'flit_core>=3.12,<5'
	@touch $@

# maturin hands pip the requirements of all extras, and pip prints a line for each one it leaves out.
$(PACKAGE): $(TOOLS) pyproject.toml $(RUST)
	env -u CONDA_PREFIX VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/maturin develop --release --locked \
		| sed '/^Ignoring .*: markers .* match your environment$$/d'
	@touch $@

# What it needs is there with the package.
$(REPRODUCTION): reproduction/pyproject.toml | $(PACKAGE)
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable ./reproduction
	@touch $@

# The requirements of some extras, by their names.
EXTRAS = $$($(BIN)/python -c 'import tomllib; \
	extras = tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]; \
	print(*(each for name in "$(1)".split() for each in extras[name]))')

# On top of the package, which is built anew without asking for these again.
$(INSTALLED): pyproject.toml $(REPRODUCTION) | $(PACKAGE)
	$(BIN)/python -m pip install --quiet $(call EXTRAS,test dev)
	@touch $@

$(SITE_TOOLS): $(INSTALLED)
	$(BIN)/python -m pip install --quiet $(call EXTRAS,docs)
	@touch $@

.PHONY: check-tools
check-tools:
	@command -v cargo >/dev/null || { echo 'Rust is needed: https://rustup.rs'; exit 1; }
	@test -n "$(PYTHON)" && $(PYTHON) -c '$(IS_USABLE)' || { echo 'Python 3.11 or newer with its' \
		'venv module is needed (Debian: python3-venv): make PYTHON=/path/to/python3'; exit 1; }
