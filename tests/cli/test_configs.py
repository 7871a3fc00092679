"""Config files, signatures, and what the stage graph declares."""

from __future__ import annotations

import ast
import inspect
import re

import hydra
import pytest
import yaml
from omegaconf import DictConfig, OmegaConf

from pipeline.__main__ import CONF, PROGRAM
from tests.conftest import stages

ROOT = CONF.parent
#: What models have in common; not a choice on the command line.
SHARED = ("training", "detachment")
GROUPS = [
    f"{group}={name}" for group, names in PROGRAM.groups().items() if group not in SHARED for name in names
]
PARAMS = yaml.safe_load((ROOT / "params.yaml").read_text())
STAGES = stages()
#: Sweeps, and what reads them, are no part of the graph, nor is what writes a file of the program.
NODES = [verb for verb in PROGRAM.verbs if verb not in ("compare", "calibrate_withheld")]


def composed(verb: str, *overrides: str) -> DictConfig:
    return PROGRAM.compose(verb, [f"hydra.runtime.output_dir={ROOT}", *overrides], with_hydra=True)


def stage_of(config: DictConfig) -> object:
    return hydra.utils.get_method(config["_target_"])


@pytest.mark.parametrize("verb", PROGRAM.verbs)
def test_a_signature_is_its_config_schema(verb: str) -> None:
    config = composed(verb)
    signature = inspect.signature(stage_of(config))  # type: ignore[arg-type]
    assert set(config) - {"_target_", "hydra"} == set(signature.parameters)
    assert all(p.annotation is not p.empty for p in signature.parameters.values())


@pytest.mark.parametrize("verb", NODES)
def test_every_stage_has_a_verb_a_config_and_a_node(verb: str) -> None:
    assert verb in STAGES
    assert f"python -m pipeline {verb} " in STAGES[verb]["cmd"].replace("\n", " ") + " "


@pytest.mark.parametrize("choice", GROUPS)
def test_every_choice_composes_and_instantiates(choice: str) -> None:
    group = choice.split("=")[0]
    verb = next(verb for verb in PROGRAM.verbs if group in PROGRAM.choices(verb))
    config = composed(verb, choice)
    OmegaConf.set_readonly(config.hydra, False)
    resolved = OmegaConf.to_container(config[group], resolve=True)
    assert hydra.utils.instantiate(resolved) is not None


#: Stages that train models of systems, and of the detachment.
TRAINED = {
    "sequence": ("train_jumps", "evaluate_jumps", "attribute"),
    "detachment": ("train_jumps", "evaluate_jumps", "attribute"),
    "drivetrain": ("train", "evaluate", "tune"),
    "one_step": (
        "train_slider_crank",
        "evaluate_slider_crank",
        "train_recurrent",
        "train_slow",
        "train_bare",
    ),
}


@pytest.mark.parametrize("name", sorted(p.stem for p in (CONF / "training").glob("*.yaml")))
def test_shared_files_are_used_and_their_change_reruns_the_models(name: str) -> None:
    files = [*(CONF / "model").glob("*.yaml"), *(CONF / "detachment").glob("*.yaml")]
    assert any(f"/training@_here_: {name}\n" in p.read_text() for p in files)
    for stage in TRAINED.get(name, TRAINED["one_step"]):
        assert f"conf/training/{name}.yaml" in STAGES[stage].get("do", STAGES[stage])["deps"]


def test_models_and_splits_of_jumps_exist_and_their_change_reruns_them() -> None:
    for split, family in PARAMS["jumps"].items():
        assert split in PROGRAM.groups()["split"]
        entries = yaml.safe_load((CONF / "model" / f"{family}.yaml").read_text())["defaults"]
        members = {
            name
            for e in entries
            if isinstance(e, dict)
            for at, name in e.items()
            if at.startswith("/detachment")
        }
        assert members
        for stage in ("train_jumps", "evaluate_jumps"):
            declared = {next(iter(p)) for p in STAGES[stage]["do"]["params"]}
            assert {f"conf/detachment/{member}.yaml" for member in members} <= declared


@pytest.mark.parametrize("kind", ["models", "tuned", "splits", "mechanisms", "hybrids", "campaigns"])
def test_params_name_existing_files(kind: str) -> None:
    group = {"splits": "split", "mechanisms": "mechanism", "campaigns": "source"}.get(kind, "model")
    for name in PARAMS[kind]:
        assert name in PROGRAM.groups()[group]


@pytest.mark.parametrize("verb", NODES)
def test_a_stage_declares_the_configs_that_hydra_chooses(verb: str) -> None:
    """Every conf file that the command composes is a parameter of the stage, so that editing it reruns it."""
    stage = STAGES[verb]
    declared = {next(iter(p)) if isinstance(p, dict) else p for p in stage["params"]}
    assert str(PROGRAM.config(verb).relative_to(ROOT)) in declared
    overridden = dict(re.findall(r"(\w+)=(\$\{[\w.]+\})", stage["cmd"]))
    for entry in yaml.safe_load(PROGRAM.config(verb).read_text()).get("defaults", []):
        if isinstance(entry, dict):
            ((group, name),) = entry.items()
            choice = overridden.get(group, name)  # a name, or ${item}
            file = PROGRAM.groups()[group].get(choice, CONF / group / f"{choice}.yaml")
            assert str(file.relative_to(ROOT)) in declared, group


def test_heavy_imports_are_lazy() -> None:
    heavy = {"torch", "numba", "shap", "matplotlib", "scipy", "pandas", "hydra"}
    tree = ast.parse((ROOT / "pipeline" / "__main__.py").read_text())
    top = {n.name.split(".")[0] for node in tree.body if isinstance(node, ast.Import) for n in node.names}
    assert not top & heavy
