# the usual commands; `just` lists them

default:
    @just --list

# an environment to work in
setup:
    python3 -m venv .venv && .venv/bin/pip install -q -e ".[test]"

# both FMUs and all scenarios
build:
    .venv/bin/cosim-fmus build --out build

# the 11 km scenario
run: build
    .venv/bin/cosim-master build/deepsea_11km.ssp

test *arguments:
    .venv/bin/python -m pytest {{arguments}}

# what takes minutes
test-slow:
    .venv/bin/python -m pytest -m slow

lint:
    .venv/bin/ruff check .

# types, strictly, of the packages named in pyproject.toml
types:
    .venv/bin/python .ci/check_types.py

# speed and accuracy
bench: build
    .venv/bin/python benchmarks/deepsea.py build
    .venv/bin/python benchmarks/coupling_error.py build
    .venv/bin/python benchmarks/sweep.py build
    .venv/bin/python benchmarks/native_step.py build/deepsea_0km.ssp

# whether the diagnosis says what it said at a commit, to the last digit; d218b3d --after 5a219d7 is the move of gap/
same-diagnoses before *arguments:
    .venv/bin/python -m benchmarks.same_diagnoses --before {{before}} {{arguments}}
