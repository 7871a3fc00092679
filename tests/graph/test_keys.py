"""Keys of verbs and of configuration files in params.yaml, as `dvc exp run -S` writes them there."""

import shutil
from pathlib import Path

import pytest
from dvc.utils.hydra import apply_overrides

from pipeline import digests
from pipeline.__main__ import PROGRAM
from pipeline.keys import added_words, check_keys, read_keys
from tests.conftest import ROOT
from unmodelled.base.errors import BadInput

CHOICES = sorted(
    (group, name)
    for verb in PROGRAM.verbs
    for group, names in PROGRAM.choices(verb).items()
    for name in names
)


@pytest.fixture
def params(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of params.yaml in the working folder."""
    shutil.copy(ROOT / "params.yaml", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "params.yaml"


def test_keys_of_every_verb_and_choice_can_be_set(params: Path) -> None:
    """DVC itself refuses a file with `???` or `${hydra:...}`, and resolves what others interpolate."""
    verbs = [f"+keys.{verb}.seed=3" for verb in PROGRAM.verbs]
    choices = [f"+keys.{group}.{name}.batch=1" for group, name in set(CHOICES)]
    apply_overrides(params, [*verbs, *choices])
    keys = read_keys()
    check_keys(keys, PROGRAM)
    for verb in PROGRAM.verbs:
        assert added_words(keys, [verb, "out=a"], PROGRAM)[-1] == "seed=3"
    for group, name in CHOICES:
        verb = next(verb for verb in PROGRAM.verbs if group in PROGRAM.choices(verb))
        assert f"{group}.batch=1" in added_words(keys, [verb, f"{group}={name}"], PROGRAM)


def test_a_key_is_given_to_the_stages_that_it_concerns() -> None:
    keys = {
        "model": {"f_h1": {"fit": {"batch": 100}}},
        "tune": {"name": "it's", "hidden": [4, 8], "on": None},
    }
    given = ["name='it\\'s'", "hidden=[4, 8]", "on=null"]
    assert added_words(keys, ["tune", "model=f_h1"], PROGRAM) == ["model.fit.batch=100", *given]
    assert added_words(keys, ["tune"], PROGRAM) == given  # its default is another model
    assert added_words(keys, ["train", "model='f_h1'"], PROGRAM) == ["model.fit.batch=100"]
    assert added_words(keys, ["train", "model=f_h2"], PROGRAM) == []
    assert added_words(keys, ["--help"], PROGRAM) == []


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ({"tuen": {"seed": 1}}, "keys.tuen: no verb and no group; did you mean 'tune'"),
        ({"model": {"f_h11": {}}}, "keys.model.f_h11: no such file in conf/model; did you mean 'f_h1'"),
        ({"tune": {"out": "a"}}, "keys.tune.out: dvc.yaml says where"),
        ({"tune": 3}, "keys.tune: must be a mapping of keys and values, got 3"),
        ({"training": {"sequence": {"most": 1}}}, "keys.training: no verb and no group"),
    ],
)
def test_wrong_names_are_refused(keys: dict[str, object], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        check_keys(keys, PROGRAM)


@pytest.mark.long
def test_keys_are_part_of_what_they_change(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    params = digests.configuration(Path("params.yaml"))
    before = digests.all_digests(params, {})
    after = digests.all_digests(params, {"model": {"f_h1": {"batch": 1}}, "evaluate": {"seed": 1}})
    changed = {name for name in after if after[name] != before[name]}
    assert changed == {"model/f_h1", "lists/models", "lists/tuned", "evaluate"}
    assert "lists/keys" not in after
