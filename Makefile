# `make report` and `make test` need git, make and python3.11; everything else they set up in .venv.
SHELL := /bin/bash
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
PROFILE ?= full

.PHONY: help report measured test check bench fuzz survive docs clean

help:            ## this list
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

report: $(VENV)/ready  ## run the whole graph on the virtual campaign and build reports/index.html
	@$(call choose,virtual,quick,)
	@$(MAKE) --no-print-directory repro

measured: $(VENV)/ready  ## the same on the measured data: DATASET=<folder or zip>, EMPS=<folder>, PROFILE=full|quick
	@$(call choose,measured,$(PROFILE),$(if $(EMPS),measured))
	@$(MAKE) --no-print-directory repro

# `dvc repro` runs one stage at a time; two parts of the graph that share nothing run side by side, then what needs both
CAM := tabulate tabulate_jumps
BENCHES := tabulate_clutch tabulate_slider_crank tabulate_withheld
REPRO := PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/dvc --wait-for-lock repro
.PHONY: repro cam benches
cam: $(VENV)/ready
	@set -o pipefail; $(REPRO) $(CAM) 2>&1 | sed -u 's/^/cam      | /'

benches: $(VENV)/ready
	@set -o pipefail; $(REPRO) $(BENCHES) 2>&1 | sed -u 's/^/benches  | /'

repro: $(VENV)/ready
	@$(BIN)/python -m pipeline.mend
	@$(MAKE) --no-print-directory --jobs=2 cam benches
	@$(REPRO)
	@echo "open file://$(CURDIR)/reports/index.html"

# in the order of tests/conftest.py: the longest first, so that no core waits for it in the end
test: $(VENV)/ready  ## all tests, a file of them at a time on every core: ARGS=<more arguments of pytest>
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pytest --numprocesses auto --dist loadfile \
		--no-loadscope-reorder $(ARGS)

check: $(VENV)/ready  ## style, types, layering
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/ready  ## speed against peers, as ratios in one run
	$(BIN)/python -m benchmarks

fuzz: $(VENV)/ready    ## thousands of damaged and hostile inputs, others every time (minutes)
	FUZZ=400 FUZZ_SEED=$$(date +%s) $(BIN)/python -m pytest tests/fuzz $(ARGS)

survive: $(VENV)/ready  ## kill the whole graph thirty times at random, see that nothing is lost (most of an hour)
	$(BIN)/python -m tests.survival $(ARGS)

docs: $(VENV)/ready    ## write docs/reference from the code
	$(BIN)/python -m docs.reference.generate

clean:           ## remove what the graph made; the environment stays
	rm -rf data outputs reports/figures reports/site reports/index.html

$(VENV)/ready: pyproject.toml constraints.txt
	@test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	@echo "installing into $(VENV) (once, about a minute)"
	@$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e ".[dev,sweep]"
	@test -d .git || $(BIN)/dvc config -q --local core.no_scm true
	@touch $@

# params.yaml says which campaign, which profile and whether real machines are diagnosed; it is written only if it
# changes
choose = sed -e 's/^source:.*/source: $(1)/' -e 's/^profile:.*/profile: $(2)/' -e 's/^real:.*/real: [$(3)]/' \
	params.yaml > params.yaml.tmp \
	&& (cmp -s params.yaml params.yaml.tmp && rm params.yaml.tmp || mv params.yaml.tmp params.yaml)
