# `make report` and `make test` need git, make and python3.11; everything else they set up in .venv.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
PROFILE ?= full

.PHONY: help report measured test check bench clean

help:            ## this list
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

report: $(VENV)/ready  ## run the whole graph on the virtual campaign and build reports/index.html
	@$(call choose,virtual,quick,)
	@$(MAKE) --no-print-directory repro

measured: $(VENV)/ready  ## the same on the measured data: DATASET=<folder or zip>, EMPS=<folder>, PROFILE=full|quick
	@$(call choose,measured,$(PROFILE),$(if $(EMPS),measured))
	@$(MAKE) --no-print-directory repro

.PHONY: repro
repro: $(VENV)/ready
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/dvc repro
	@echo "open file://$(CURDIR)/reports/index.html"

test: $(VENV)/ready  ## all tests, a file of them at a time on every core: ARGS=<more arguments of pytest>
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pytest --numprocesses auto --dist loadfile $(ARGS)

check: $(VENV)/ready  ## style, types, layering
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/ready  ## speed against peers, as ratios in one run
	$(BIN)/python -m benchmarks

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
