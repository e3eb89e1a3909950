# make run: estimate the sample log.   make test: check and test.   All set up .venv first.
# make docs: renew what the pages print, and README's picture.
# make fuzz: ten minutes of mutated files of every kind, into out/fuzz what is read wrongly.
# make bench: how fast it is, into docs/performance.md.   make bench-hour: memory over an hour of log.
# make bench-service: how fast a service answers, and what kills cost it.
PYTHON ?= $(firstword $(shell command -v python3.11 python3 python))
BIN := .venv/bin

.PHONY: run test docs fuzz bench bench-hour bench-service

run: .venv/.stamp
	$(BIN)/objstate estimate logs/corridor.mcap --building models/corridor/corridor.urdf \
		--truth logs/corridor.truth.csv --out out/corridor --overwrite

# Workers are one more than cores, since tests that wait for other processes leave theirs idle.
# Threads of linear algebra would only contend for them.
test: export OPENBLAS_NUM_THREADS := 1
test: .venv/.stamp
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy --strict objstate
	$(BIN)/lint-imports
	$(BIN)/pytest -n 3 --dist loadfile

docs: .venv/.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .[docs]
	$(BIN)/python -m docs.renew

fuzz: .venv/.stamp
	$(BIN)/python -m tests.fuzz --minutes 10

bench: .venv/.stamp
	$(BIN)/python -m benchmarks.speed

bench-hour: .venv/.stamp
	$(BIN)/python -m benchmarks.speed --hour

bench-service: .venv/.stamp
	$(BIN)/python benchmarks/service.py
	$(BIN)/python benchmarks/service_live.py 4
	$(BIN)/python benchmarks/service_live.py 8
	$(BIN)/python benchmarks/service_history.py
	$(BIN)/python benchmarks/service_soak.py

.venv/.stamp: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .[dev]
	$(BIN)/python -m compileall -q objstate
	$(BIN)/objstate compile
	@touch $@
