# The commands that people type. CMakePresets.json holds the build's settings, tools/setup.sh gets
# what is not in the repository. Everything is repeatable and takes seconds when nothing changed.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.NOTPARALLEL:

PREFIX ?= /usr/local
DATASET ?=
MODE ?=

# One compiler per core, but no more than fit into memory at 2 GB each.
JOBS ?= $(shell awk -v cores=$$(nproc) '/MemAvailable/ { fit = int($$2 / 2e6); \
	print fit < 1 ? 1 : fit < cores ? fit : cores }' /proc/meminfo)

.PHONY: help setup configure build test demo install asan tsan format tidy clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z ]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' Makefile

setup:
	@tools/setup.sh

configure: setup
	@cmake --preset release --log-level=WARNING $(CMAKE_ARGS) > build/configure.log 2>&1 || \
		{ cat build/configure.log; exit 1; }

build: configure ## set up, and build the program: build/rover
	@cmake --build --preset release -j $(JOBS) --target rover

test: configure ## set up, build everything, run the tests
	@tools/setup.sh --tests
	@cmake --build --preset release -j $(JOBS)
	@ctest --preset release -j $(JOBS)

demo: build ## make a flight (or take DATASET=folder MODE=mono), run on it, report
	@tools/demo.sh "$(DATASET)" "$(MODE)"

install: ## build and install under PREFIX (/usr/local)
	@$(MAKE) --no-print-directory build CMAKE_ARGS="-DCMAKE_INSTALL_PREFIX='$(PREFIX)' $(CMAKE_ARGS)"
	@cmake --build --preset release -j $(JOBS) --target rover_install
	@cmake --install build --prefix "$(PREFIX)" > build/install.log && \
		echo "installed under $(PREFIX)"

asan tsan: setup ## the tests under sanitizers (address + undefined; thread)
	@tools/setup.sh --tests
	@cmake --preset $@ --log-level=WARNING > build/configure-$@.log || \
		{ cat build/configure-$@.log; exit 1; }
	@cmake --build --preset $@ -j $(JOBS)
	@ctest --preset $@ -j $(JOBS)

format: ## clang-format over all sources
	@git ls-files '*.h' '*.cc' | xargs clang-format -i

tidy: configure ## clang-tidy over all sources
	@git ls-files 'rover/*.cc' | xargs -P $(JOBS) -n 4 clang-tidy -p build --quiet

clean: ## remove what was built; what the set-up fetched stays
	@test ! -f build/build.ninja || cmake --build build --target clean
	@rm -rf build/debug build/asan build/tsan build/demo
