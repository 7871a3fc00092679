"""A copy of the checkout whose whole graph takes minutes: a few short experiments, hardly any training."""

import shutil
from collections.abc import Mapping
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PROGRAM = ("unmodelled", "pipeline")
SOURCE = """_target_: pipeline.rigs.campaign.CamFollowerCampaign
H: [0.01, 0.03]
beta: [1.5707963267949, 3.14159265358979]
m: [0.9379, 1.3067]
V: [4.0, 5.2, 6.4, 7.6, 8.8]
"""
SLIDER = """_target_: pipeline.rigs.slider_crank.SliderCrankCampaign
profiles: [1, 6, 9]
samples: 300
spring: """
#: A hoist with Stribeck friction, and one without any fault.
WITHHELD = """defaults: [withheld]
count: 1
seed: 1566
"""
PLANTED = ["single", "null"]
PROFILE = """repeats: 2
steps: 30
hybrid_steps: 3
tune_steps: 30
widths: [4, 8]
system_repeats: 1
epochs: 2
recurrent_epochs: 1
window_epochs: 1
shooting_epochs: 4
data_sets: 2
samples: 1000
sampling_repeats: 2
sequence_updates: 10
bounce_members: 1
explained_runs: 2
references: 4
exact_runs: 1
exact_references: 2
"""
#: A search this short finds no optimum; what follows from one is the same.
SEARCH = {"generations: 60": "generations: 2"}
TUTORIAL = {"repeats: 3": "repeats: 1", "[1, 2, 3, 4, 8, 16, 64]": "[1, 4, 64]", "seeds: 10": "seeds: 2"}
#: One hybrid of each kind that figures and claims need.
HYBRIDS = [
    *("nnap", "nnap_theta_omega", "nnap_d", "nnap_split", "nnap_shooting", "physics"),
    *("hybrid_free", "hybrid_m3", "hybrid_l1", "hybrid_l1_m3"),
]


def write_project(folder: Path, linked: bool = False) -> Path:
    """Write the copy to `folder`, and return it.

    `linked`: rooms of the program are links, so that functions that numba has compiled there count here.
    """
    for part in (part for name in PROGRAM if linked for part in (ROOT / name).iterdir()):
        (folder / part.parent.name).mkdir(exist_ok=True)
        if part.name not in ("conf", "__pycache__"):
            (folder / part.parent.name / part.name).symlink_to(part)
    for name in ("conf", "docs/results", "systems", ".dvc", *(("unmodelled/conf",) if linked else PROGRAM)):
        ignored = shutil.ignore_patterns("__pycache__", "cache", "tmp", "config.local", "dvc.lock")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for name in ("dvc.yaml", "params.yaml", ".dvcignore", ".gitignore", "Makefile"):
        shutil.copy(ROOT / name, folder / name)
    (folder / "conf" / "source" / "virtual.yaml").write_text(SOURCE)
    for conf in (folder / "conf", folder / "unmodelled" / "conf"):
        (conf / "profile" / "quick.yaml").write_text(PROFILE)
    for name, spring in (("slider_crank", "true"), ("slider_crank_bare", "false")):
        (folder / "conf" / "source" / f"{name}.yaml").write_text(f"{SLIDER}{spring}\n")
    (folder / "conf" / "source" / "withheld_quick.yaml").write_text(WITHHELD)
    _edit(folder / "unmodelled" / "conf" / "uncertainty" / "clipped_normal.yaml", SEARCH)
    _edit(folder / "conf" / "teach.yaml", TUTORIAL)
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    params |= {"source": "virtual", "profile": "quick", "hybrids": HYBRIDS, "horizons": [1, 10]}
    params |= {"planted": PLANTED}
    (folder / "params.yaml").write_text(yaml.safe_dump(params))
    # no git in the copy, as in a tarball
    (folder / ".dvc" / "config.local").write_text("[core]\n    no_scm = true\n")
    return folder


def _edit(file: Path, changes: Mapping[str, str]) -> None:
    text = file.read_text()
    for before, after in changes.items():
        assert before in text, (file, before)
        text = text.replace(before, after)
    file.write_text(text)
