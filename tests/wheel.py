"""What `make wheel` asks of the environment with nothing but the wheel, by that environment's Python."""

import json
import sys
from importlib.util import find_spec
from pathlib import Path

import unmodelled
from unmodelled.cli.program import version

assert "site-packages" in unmodelled.__file__, unmodelled.__file__
installed = [name for name in ("torch", "dvc", "shap", "mujoco", "pyarrow", "pipeline") if find_spec(name)]
assert not installed, installed
found = json.loads(Path(sys.argv[1]).read_text())
assert found["verdict"] == "effect", found["verdict"]
(effect,) = found["effects"]
assert effect["family"] == "coulomb_friction", effect["family"]
value = effect["parameters"]["F_c"]["value"]
assert abs(value - 0.06) < 0.001, value  # what conf/source/pendulum.yaml plants
page = Path(sys.argv[1]).with_name("index.html").read_text()
assert all(word in page for word in ("const machine = ", "const simulation = ", "uPlot"))
print(f"{version()}: coulomb_friction of {value:.4f} N m found, 0.06 N m planted")
