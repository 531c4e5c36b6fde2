# Everything runs in .venv, which `make setup` builds from uv.lock; nothing else need be installed
# but Python 3.11 or newer. Extra arguments: make test ARGS="-k wait".

BIN := .venv/bin
STAMP := .venv/.set-up
ARGS :=

# The lock names the public index wherever it is made; certificates and proxies are the user's.
UV_LOCK := env -u UV_DEFAULT_INDEX -u UV_INDEX -u UV_INDEX_URL -u UV_EXTRA_INDEX_URL \
	-u UV_FIND_LINKS .tools/uv lock --default-index https://pypi.org/simple \
	--no-config --no-python-downloads

# Whatever environment the calling shell is in, this project uses its own.
unexport VIRTUAL_ENV PYTHONHOME PYTHONPATH PYTHONSAFEPATH UV_PROJECT UV_WORKING_DIR
# Python keeps what it compiled of its modules, as it does by default: commands start sooner.
unexport PYTHONDONTWRITEBYTECODE

# A shell fragment that puts a Python that is new enough into $$python.
find_python := python=$$(tools/find_python.sh $(PYTHON)) || exit

.PHONY: help setup system-packages demo test long-test recordings-test public-files target-test prove verify verify-part validate-diagnosis paper bench check
.PHONY: format generate lock clean
.PHONY: check-lock check-format check-lint check-types check-floors check-specs check-tests check-generated

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-15s %s\n", $$1, $$2 }' Makefile

setup: $(STAMP) ## build .venv with everything, this project included
	@:

$(STAMP): pyproject.toml uv.lock tools/create_venv.py
	@$(find_python); exec $$python tools/create_venv.py

# A compiler for the target and its C library, its emulator, a second one and what counts with it,
# rules of MISRA C, value analysis, what builds an FMU from its sources.
SYSTEM_PACKAGES := gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm clang-19 llvm-19 libclang-rt-19-dev cppcheck frama-c-base why3 z3 cmake
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

system-packages: ## install what the target needs (Debian, Ubuntu), if it is not there
	@dpkg-query --show $(SYSTEM_PACKAGES) >/dev/null 2>&1 || { $(SUDO) apt-get -o Acquire::Retries=3 update && \
		$(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=3 install --yes \
		--no-install-recommends $(SYSTEM_PACKAGES); }

demo: setup ## show the product at work
	@$(BIN)/modewright demo $(ARGS)

test long-test recordings-test target-test: export CI := true
test long-test recordings-test target-test: export HYPOTHESIS_PROFILE := ci
test long-test recordings-test target-test: export LC_ALL := C
test long-test recordings-test target-test: export MPLBACKEND := Agg
test long-test recordings-test target-test: export OMP_NUM_THREADS := 1
test long-test recordings-test target-test: export OPENBLAS_NUM_THREADS := 1
test long-test recordings-test target-test: export PYTHONHASHSEED := 0
test long-test recordings-test target-test: export PYTHONUTF8 := 1
test long-test recordings-test target-test: export TZ := UTC
test: setup ## run the tests but the long ones, those of recordings and those of the target
	$(BIN)/pytest -n 2 --dist worksteal -q --ignore=tests/codegen/target -m "not long and not recordings" $(ARGS)

long-test: setup ## run the long ones: proofs, fuzzing, methods of integration
	$(BIN)/pytest -n 2 --dist worksteal -q --ignore=tests/codegen/target -m "long and not recordings" $(ARGS)

recordings-test: setup ## run the tests of real recordings: ARGS="--recordings=DIR" or MODEWRIGHT_RECORDINGS
	$(BIN)/pytest -n 2 --dist worksteal -q --ignore=tests/codegen/target -m recordings $(ARGS)

public-files: setup ## read public files of third parties: DIR=folder with owner/name/path; without: how to obtain them
	@$(BIN)/python -m tests.public.read_public_files $(if $(DIR),"$(DIR)",--how) $(ARGS)

target-test: setup ## compare the C on an emulated Cortex-M4F with the engine, and prove contracts
	$(BIN)/pytest -n 2 --dist worksteal -q tests/codegen/target $(ARGS)

prove: setup ## check the C of every sampled automaton by compilers, cppcheck and Frama-C
	$(BIN)/python tests/validation/evidence/proofs.py

verify: setup ## measure every figure of docs/evidence; with recordings: ARGS="--recordings DIR"
	$(BIN)/python tests/validation/evidence/run_all.py $(ARGS)

verify-part: setup ## measure a fixed part of the figures, as CI does
	$(BIN)/python tests/validation/evidence/run_all.py --part
	$(BIN)/python -m tests.validation.study.regression_cases

validate-diagnosis: setup ## diagnose cases of several generators, write docs/validation.md (hours; resumable)
	$(BIN)/python -m tests.validation.study $(ARGS)

paper: setup ## reproduce the reference paper from specs: docs/paper, build/paper.json (minutes; resumable)
	$(BIN)/python -m tests.validation.paper $(ARGS)

bench: setup ## measure speed against rivals; with ARGS="--peers diffrax,pathsim" those too
	$(BIN)/python tests/benchmark/run_benchmark.py $(ARGS)

check: check-lock check-format check-lint check-types ## run all checks
check: check-floors check-specs check-tests check-generated

check-lock: setup
	@$(UV_LOCK) --check --quiet --offline --no-cache --python $(BIN)/python 2>/dev/null || \
		{ echo "uv.lock does not fit pyproject.toml: make lock" >&2; exit 1; }

check-format: setup
	$(BIN)/ruff format --check .

check-lint: setup
	$(BIN)/ruff check .

check-types: setup
	$(BIN)/mypy

check-floors: setup
	$(BIN)/lint-imports --no-logo

check-specs: setup
	$(BIN)/modewright check --all
	$(BIN)/modewright format --check spec

check-tests: setup
	$(BIN)/modewright test

check-generated: setup
	$(BIN)/modewright generate --all --check

format: setup ## format the code and repair what can be repaired
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

generate: setup ## write the generated C and the JSON Schema anew
	$(BIN)/modewright generate --all $(ARGS)
	$(BIN)/modewright schema --out spec/modewright.schema.json

.tools/uv: tools/fetch_uv.py
	@$(find_python); exec $$python tools/fetch_uv.py $@

lock: .tools/uv ## pin the dependencies anew (ARGS=--upgrade for newer ones)
	@$(find_python); settings=$$($$python tools/package_index_settings.py) || exit; eval "$$settings"; \
	$(UV_LOCK) --python $$python $(ARGS)

clean: ## remove .venv, fetched tools, caches and build products
	rm -rf .venv .tools .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
	rm -rf build dist *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
