"""Two programs of one command line, their config files, signatures, and what the stage graph declares."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import hydra
import pytest
import yaml
from omegaconf import DictConfig, OmegaConf

from pipeline.__main__ import CONF, PROGRAM, main
from tests.conftest import stages
from unmodelled.__main__ import PROGRAM as LIBRARY


def test_the_dissertation_has_every_verb_of_the_library() -> None:
    assert set(LIBRARY.verbs) < set(PROGRAM.verbs)
    assert {verb: PROGRAM.target(verb) for verb in LIBRARY.verbs} == {
        v: LIBRARY.target(v) for v in LIBRARY.verbs
    }


@pytest.mark.parametrize("verb", LIBRARY.verbs)
def test_a_verb_of_the_library_has_the_same_configuration_in_both(verb: str) -> None:
    shared = ["hydra.runtime.output_dir=out"]
    ours, theirs = LIBRARY.compose(verb, shared), PROGRAM.compose(verb, shared)
    if PROGRAM.config(verb) == LIBRARY.config(verb):
        assert ours == theirs
    else:  # the dissertation has other defaults, of the same keys
        assert set(ours) == set(theirs)
        assert ours["_target_"] == theirs["_target_"]


def test_of_two_config_files_of_one_name_the_shared_keys_are_equal() -> None:
    for group, files in LIBRARY.groups().items():
        for name, file in files.items():
            other = PROGRAM.groups()[group][name]
            if other != file:
                own, theirs = yaml.safe_load(file.read_text()), yaml.safe_load(other.read_text())
                assert own.items() <= theirs.items(), name


ROOT = CONF.parent


@pytest.mark.parametrize("module", ["unmodelled", "pipeline"])
def test_a_reader_may_stop_before_the_end(module: str) -> None:
    run = f"{sys.executable} -m {module} --help | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", run], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ")


def test_a_reader_may_stop_before_a_verb_says_anything(tmp_path: Path) -> None:
    """The results are written all the same."""
    logs, system = tmp_path / "logs", ROOT / "systems" / "pendulum.yaml"
    assert main(["acquire", "source=pendulum", f"out={logs}"]) == 0
    verb = f"{sys.executable} -m unmodelled simulate {system} {logs} out={tmp_path / 'out'} -q"
    run = f"{verb} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", run], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "index.html").exists()


#: Groups that files of models or profiles have in common; not a choice on the command line.
SHARED = ("budget", "detachment", "training")
GROUPS = [
    f"{group}={name}" for group, names in PROGRAM.groups().items() if group not in SHARED for name in names
]
PARAMS = yaml.safe_load((ROOT / "params.yaml").read_text())
STAGES = stages()
#: Of no part of the graph: what reads sweeps or answers, diagnoses at once, drafts, or measures further
#: experiments of diagnosed cases.
WITHOUT_NODE = (
    *("audit", "compare", "diagnose", "example", "export", "init", "next", "plan", "report"),
    *("propose_withheld", "tabulate_proposals"),
)
NODES = [verb for verb in PROGRAM.verbs if verb not in WITHOUT_NODE]


def composed(verb: str, *overrides: str) -> DictConfig:
    return PROGRAM.compose(verb, [f"hydra.runtime.output_dir={ROOT}", *overrides], with_hydra=True)


@pytest.mark.parametrize("verb", PROGRAM.verbs)
def test_a_signature_is_its_config_schema(verb: str) -> None:
    config = composed(verb)
    signature = inspect.signature(hydra.utils.get_method(config["_target_"]))
    assert set(config) - {"_target_", "hydra"} == set(signature.parameters)
    assert all(p.annotation is not p.empty for p in signature.parameters.values())


@pytest.mark.parametrize("verb", NODES)
def test_every_verb_has_a_node(verb: str) -> None:
    commands = [" ".join(stage.get("do", stage)["cmd"].split()) + " " for stage in STAGES.values()]
    assert any(re.search(rf"(pipeline|pipeline\.cells|\+) {verb} ", command) for command in commands)


@pytest.mark.parametrize("choice", GROUPS)
def test_every_choice_composes_and_instantiates(choice: str) -> None:
    group = choice.split("=")[0]
    verb = next(verb for verb in PROGRAM.verbs if group in PROGRAM.choices(verb))
    config = composed(verb, choice)
    OmegaConf.set_readonly(config.hydra, False)
    resolved = OmegaConf.to_container(config[group], resolve=True)
    assert hydra.utils.instantiate(resolved) is not None


@pytest.mark.parametrize("name", PROGRAM.groups()["training"])
def test_shared_files_are_used(name: str) -> None:
    files = [*PROGRAM.groups()["model"].values(), *PROGRAM.groups()["detachment"].values()]
    assert any(f"/training@_here_: {name}\n" in p.read_text() for p in files)


@pytest.mark.parametrize("kind", ["models", "tuned", "splits", "hybrids", "campaigns"])
def test_params_name_existing_files(kind: str) -> None:
    group = {"splits": "split", "campaigns": "source"}.get(kind, "model")
    for name in PARAMS[kind]:
        assert name in PROGRAM.groups()[group]
