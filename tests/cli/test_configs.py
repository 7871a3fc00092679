"""Config files, signatures, and what the stage graph declares."""

import inspect
import re

import hydra
import pytest
import yaml
from omegaconf import DictConfig, OmegaConf

from pipeline.__main__ import CONF, PROGRAM
from tests.conftest import stages

ROOT = CONF.parent
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
    *("compare", "diagnose", "export", "init", "next", "plan", "report"),
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
