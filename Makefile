# What a user and a developer type. `make` alone lists the targets.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.NOTPARALLEL:

TARGET_DIR := $(or $(CARGO_TARGET_DIR),target)
CAUSTICA := $(TARGET_DIR)/release/caustica
DEMO := projects/gallery/gallery.caustica.json
# What a report says of the program's source.
export CAUSTICA_COMMIT ?= $(shell git rev-parse --short=9 HEAD 2>/dev/null)
# Of the demo picture; `make demo SIZE=1920x1080 SAMPLES=256` overrides them.
SIZE ?= 960x540
SAMPLES ?= 48

.PHONY: help setup compiler demo test mutate check clean

help: ## list these targets
	@awk -F ':.*## ' '/^[a-z]+:.*## /{printf "make %-10s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))

setup: ## install what is missing, build, find a device that can trace rays
	@scripts/setup.sh

# The window where there is a display, otherwise a picture; `DISPLAY= make demo` asks for the picture.
demo: setup ## open the demo project, or render out/demo.png where there is no display
	@if [ -n "$${DISPLAY:-}$${WAYLAND_DISPLAY:-}" ]; then \
	  exec $(CAUSTICA) $(DEMO); \
	else \
	  mkdir -p out; \
	  exec $(CAUSTICA) render $(DEMO) -o out/demo.png --size $(SIZE) --samples $(SAMPLES); \
	fi

# Most tests draw a few small frames: on a machine without a GPU, compiling shaders is most of their time, so Mesa's compiler is told
# not to optimise them (GALLIVM_PERF: three to four times faster to compile, half as fast to run).
test: ## all tests, headless (installs the test tools that are missing)
	@scripts/setup.sh --test
	NODE_PATH=$${NODE_PATH:-$(abspath $(TARGET_DIR))/validator/node_modules} GALLIVM_PERF=nopt cargo test --release --workspace

# Of the test editor/scene/tests/mutations; `make mutate CASES=1000000` overrides it.
CASES ?= 100000
mutate: ## import damaged files (CASES of them; make test runs a share)
	CAUSTICA_MUTATIONS=$(CASES) cargo test --release -p caustica-scene --test mutations -- --nocapture

# In the release profile, so that the build scripts of the dependencies (glslang's C++ above all) run once for
# demo, check and test.
check: compiler ## format, lints and documentation, warnings as errors
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --workspace

compiler:
	@scripts/setup.sh --compiler

clean: ## remove what was built and rendered
	cargo clean
	rm -rf out
