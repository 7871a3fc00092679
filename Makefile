# `make report` and `make test` need git, make and python3.11; everything else they set up in .venv.
SHELL := /bin/bash
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
PROFILE ?= full

# a measured machine, and the variable that gives its data
MACHINES := emps:EMPS cam_drivetrain:DATASET xl330:XL330 so101:SO101 ur10e_joint:UR10E \
	double_pendulum:DOUBLE_PENDULUM silverbox:SILVERBOX cascaded_tanks:CASCADED_TANKS
empty :=
comma := ,
given := $(strip $(foreach m,$(MACHINES),$(if $($(lastword $(subst :, ,$m))),$(firstword $(subst :, ,$m)))))
REAL := $(subst $(empty) $(empty),$(comma) ,$(given))

.PHONY: help status report measured real test test-all check wheel bench withheld compare fuzz survive docs clean

help:            ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

status: $(VENV)/ready  ## draw the graph: which stages would run, and when and how long each ran last
	@$(BIN)/python -m pipeline.mend && $(BIN)/python -m pipeline.status

report: repro    ## run the whole graph on the virtual campaign and build reports/index.html
report: CHOOSE = $(call choose,virtual,quick,)
report: PARTS = slider_crank drivetrain diagnoses others jumps  # the longest of the quick profile first

measured: repro  ## the same on the measured data: DATASET=<folder or zip>, PROFILE=full|quick, data as for real
measured: CHOOSE = $(call choose,measured,$(PROFILE),$(REAL))

real: $(VENV)/ready  ## diagnose published machines: EMPS=, XL330=, ... (docs/real); write reports/tables/real.csv
	@$(BIN)/python -m pipeline.mend && $(call choose,$(if $(DATASET),measured,virtual),quick,$(REAL))
	@$(REPRO) diagnose_real && $(REPRO) --single-item tabulate_real

# `dvc repro` runs one stage after the other. Before it, parts of the graph that share no stage run two at a time, so
# that both cores work. A core that is free takes the next part; the longest parts of the full profile come first.
DVC := PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/dvc
REPRO := $(DVC) --wait-for-lock repro
campaign := acquire acquire_withheld
benches := acquire_bench
logs := ingest featurize
jumps := train_jumps evaluate_jumps attribute
diagnoses := diagnose diagnose_withheld refit_withheld
slider_crank := train_slider_crank train_recurrent train_others evaluate_slider_crank
drivetrain := train tune evaluate
others := identify_uncertainty assess_uncertainty teach identifiability simulate
PARTS := jumps diagnoses slider_crank drivetrain others
.PHONY: repro campaign benches $(PARTS)
campaign benches $(PARTS):
	@$(REPRO) --single-item $($@)

CHOOSE := true
repro: $(VENV)/ready
	@$(BIN)/python -m pipeline.mend && $(CHOOSE)
	@$(REPRO) code
	@$(MAKE) --no-print-directory --jobs=2 campaign benches
	@$(REPRO) $(logs)
	@$(MAKE) --no-print-directory --jobs=2 $(PARTS)
	@$(REPRO)
	@echo "open file://$(CURDIR)/reports/index.html"

# in the order of tests/conftest.py: the longest first, so that no core waits for it in the end; a core has one process
# of tests, whose threads would only wait for those of the others
PYTEST := PATH="$(CURDIR)/$(BIN):$$PATH" OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist loadfile \
	--no-loadscope-reorder
test: $(VENV)/tools  ## the quick tests, a file of them at a time on every core (minutes): ARGS=<more arguments of pytest>
	@$(PYTEST) -m "not graph and not long" $(ARGS)

test-all: $(VENV)/tools  ## all tests, with the stage graph and whole diagnoses (less than half an hour on two cores)
	@$(PYTEST) $(ARGS)

check: $(VENV)/tools  ## style, types, layering
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# nothing of the checkout is on the path there, and none of torch, dvc, shap and mujoco is installed
WHEEL := outputs/wheel
wheel: $(VENV)/tools   ## build the wheel, install it into an empty environment, diagnose a machine with it
	@rm -rf $(WHEEL) build && mkdir -p $(WHEEL)
	@$(BIN)/python -m pip wheel -q --disable-pip-version-check --no-deps -w $(WHEEL) . && rm -rf build
	@$(PYTHON) -m venv $(WHEEL)/env
	@$(WHEEL)/env/bin/python -m pip install -q --disable-pip-version-check -c constraints.txt $(WHEEL)/*.whl
	@du -sm $(WHEEL)/env | sed 's/\t.*/ MB: the environment of the library/'
	@$(BIN)/python -m pipeline acquire -q source=pendulum out=$(WHEEL)/logs && cp systems/pendulum.yaml $(WHEEL)
	cd $(WHEEL) && env/bin/unmodelled diagnose system=pendulum.yaml logs=logs out=answer
	@$(WHEEL)/env/bin/python tests/wheel.py $(WHEEL)/answer/diagnosis.json

bench: $(VENV)/tools  ## speed against peers, as ratios in one run: ARGS=<some of them>
	$(BIN)/python -m benchmarks $(ARGS)

# the cases of one number are the same everywhere; CASES=2000 is the full run
WITHHELD := outputs/withheld
CASES ?= 100
TRACK ?= planted:7000
ENTRANT ?= unmodelled
withheld: $(VENV)/tools  ## the benchmark (docs/withheld): CASES=100 TRACK=planted:7000 ENTRANT=unmodelled; it goes on where it was stopped
	@$(BIN)/python -m benchmarks.withheld -m cases=$(TRACK):$(CASES) "case=range(0,$(CASES))" "entrant='$(ENTRANT)'" \
		out=$(WITHHELD) hydra/launcher=joblib
	@$(BIN)/python -m benchmarks.withheld.table $(firstword $(subst :, ,$(ENTRANT))) out=$(WITHHELD)

compare: $(VENV)/tools  ## the diagnosis of another working tree and this one on the same cases: OLD=TREE ARGS="cases=planted:7045:100 cases=real:FOLDER"
	@$(BIN)/python -m benchmarks.withheld.ruler old:$(OLD) unmodelled out=$(WITHHELD) $(ARGS)

fuzz: $(VENV)/tools    ## thousands of damaged and hostile inputs, others every time (minutes)
	FUZZ=400 FUZZ_SEED=$$(date +%s) $(BIN)/python -m pytest tests/fuzz $(ARGS)

survive: $(VENV)/tools  ## kill the whole graph thirty times at random, see that nothing is lost (most of an hour)
	$(BIN)/python -m tests.survival $(ARGS)

docs: $(VENV)/tools    ## write docs/reference from the code, docs/api from docstrings, and docs/answer, finished ones
	$(BIN)/python -m docs.reference.generate
	$(BIN)/python -m docs.api_pages
	$(BIN)/python -m docs.finished

clean:           ## remove what the graph made; the environment stays
	rm -rf data outputs reports/figures reports/site reports/index.html

# pip, as the user has configured it, chooses torch (for CPUs, say) and brings uv, which installs the rest in a fraction of
# pip's time; where uv cannot, pip does. Both without what setuptools has to say to who writes a package
PIP := PYTHONWARNINGS=ignore $(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt
install = $(BIN)/uv pip install -q --native-tls --python $(BIN)/python -c constraints.txt $(1) 2>/dev/null || $(PIP) --no-compile $(1)
$(VENV)/ready: pyproject.toml constraints.txt
	@test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	@echo "installing into $(VENV) (once, about a minute)"
	@$(PIP) --upgrade --no-deps pip uv torch 2>/dev/null || $(PIP) --upgrade pip
	@$(call install,-e ".[pipeline]")
	@$(BIN)/python -m compileall -q -j 0 -x '/tests?/' $(VENV)/lib unmodelled pipeline >/dev/null || true  # on all cores
	@test -d .git || $(BIN)/dvc config -q --local core.no_scm true
	@touch $@

$(VENV)/tools: $(VENV)/ready
	@echo "installing what tests and checks need (once)"
	@$(call install,-e ".[dev]")
	@touch $@

# params.yaml says which campaign, which profile and which measured machines are diagnosed
choose = sed -i -e 's/^source:.*/source: $(1)/' -e 's/^profile:.*/profile: $(2)/' -e 's/^real:.*/real: [$(3)]/' params.yaml
