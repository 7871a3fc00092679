"""Two programs of one command line: the library's, and the dissertation's with the library's verbs in it."""

import subprocess
import sys

import pytest
import yaml

from pipeline.__main__ import PROGRAM
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


@pytest.mark.parametrize("module", ["unmodelled", "pipeline"])
def test_a_reader_may_stop_before_the_end(module: str) -> None:
    run = f"{sys.executable} -m {module} --help | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", run], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ")
