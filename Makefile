# Two commands do everything: `make demo` and `make test`. Both say what they do.
SHELL := /bin/bash
.DEFAULT_GOAL := help
CARGO ?= cargo
OUT ?= out
FUZZ_SECONDS ?= 10
PREFIX ?= /usr/local

.PHONY: help demo test check fmt clippy unit doc inlined c install-c python site fuzz bench bench-build bench-python clean

help: ## List the commands
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

tools:
	@command -v $(CARGO) >/dev/null || { echo "make: cargo was not found. Install Rust with rustup (https://rustup.rs), then run this command again."; exit 1; }
	@command -v cc >/dev/null || { echo "make: no C compiler (cc) was found; Rust needs it to link. On Debian: apt-get install gcc."; exit 1; }

demo: tools ## Render a scene to a picture and print what each idea of the 1997 paper is worth on it
	@echo "==> building (release)"
	@$(CARGO) build --release --locked --quiet -p ropewalk-cli
	@mkdir -p $(OUT)
	@echo "==> rendering the SPD scene gears:4 (9,345 polygons) by the SPD rules"
	@./target/release/ropewalk render spd:gears:4 --spd-rules -o $(OUT)/gears.png
	@echo "==> the paper's experiment on the same scene"
	@./target/release/ropewalk paper --scenes gears --size standard --rays 20000 --no-sensitivity -o $(OUT)/paper.html
	@echo "==> picture: $(OUT)/gears.png   report: $(OUT)/paper.html"

test: tools fmt clippy unit doc inlined c python site fuzz ## Everything that CI runs: format, lints, tests, docs, inlining, the C library, the Python package, the site, fuzz

fmt: tools
	@echo "==> format"
	@$(CARGO) fmt --all --check

clippy: tools
	@echo "==> lints"
	@$(CARGO) clippy --workspace --all-targets --locked --quiet -- -D warnings

unit: tools
	@echo "==> tests and doc tests"
	@$(CARGO) test --workspace --locked --no-fail-fast

doc: tools
	@echo "==> docs"
	@RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps --locked --quiet

inlined: tools
	@echo "==> vector instructions inlined"
	@scripts/inlined

c: tools ## Compile, run and sanitise the examples of the C library
	@echo "==> the C library"
	@scripts/test-c

install-c: tools ## Install the C library: header, shared and static library, pkg-config file (PREFIX=/usr/local)
	@scripts/install-c $(PREFIX)

python: tools ## Build a wheel of the Python package and test it in fresh virtual environments (needs python3)
	@echo "==> the Python package"
	@scripts/test-python

site: ## Build the documentation site into target/site (needs python3)
	@echo "==> the documentation site"
	@scripts/site

fuzz: tools ## Fuzz each reader for FUZZ_SECONDS (needs a nightly toolchain)
	@scripts/fuzz $(FUZZ_SECONDS)

bench: tools ## Rays per second against Embree and other peers, recorded under bench/record
	@scripts/bench

bench-build: tools ## Time the builder from 10^4 to 10^6 triangles, and its presets on the benchmark's scenes
	@$(CARGO) run --release --locked --quiet -p ropewalk-bench --bin build_speed
	@$(CARGO) run --release --locked --quiet -p ropewalk-bench --bin build_presets

bench-python: tools ## Rays per second through Python against embreex and other packages
	@scripts/bench-python

clean: ## Remove everything made here
	@rm -rf $(OUT) target .venv-python .venv-bench-python
