"""From robot file and logs to the patched file, by the command line: planted dry friction and a rotor."""

from pathlib import Path

import mujoco
import pytest

import unmodelled as um
from tests.commands import python
from tests.diagnosis.rods import FRICTION, GIVEN_ROTOR, MJCF, ROTOR, URDF, write_rod
from unmodelled.base.files import read_json


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "given"), [pytest.param(MJCF, GIVEN_ROTOR, id="mjcf"), pytest.param(URDF, 0.0, id="urdf")]
)
def test_planted_friction_and_rotor_are_in_the_file_that_the_user_gets_back(
    robot: str, given: float, tmp_path: Path
) -> None:
    system = write_rod(tmp_path, robot)
    words = [f"system={system}", f"logs={tmp_path / 'logs'}", f"out={tmp_path / 'answer'}"]
    ran = python("-m", "unmodelled", "diagnose", *words)
    assert ran.returncode == 0, ran.stderr
    content = read_json(tmp_path / "answer" / "diagnosis.json")
    named = {effect["family"]: effect["parameters"] for effect in content["effects"]}
    assert named.keys() == {"coulomb_friction", "inertia_error"}

    file = tmp_path / "answer" / content["robot"]["file"]
    model = mujoco.MjModel.from_xml_path(str(file))
    if content["robot"]["supplement"]:
        um.supplement(model, tmp_path / "answer" / content["robot"]["supplement"])
    for found, planted, known, number in (
        (model.dof_frictionloss[0], FRICTION, 0.0, named["coulomb_friction"]["F_c"]),
        (model.dof_armature[0], ROTOR, given, named["inertia_error"]["dM"]),
    ):
        low, high = (known + end for end in number["interval"])
        assert found == pytest.approx(known + number["value"], rel=1e-6)
        assert low <= planted <= high
    replay = content["robot"]["replay"]
    assert replay["improves"]
    assert replay["supplemented" if robot is URDF else "patched"]["gap"] < 0.1 * replay["given"]["gap"]
    assert content["robot"]["file"] in ran.stdout
    assert "Your robot file, patched" in (tmp_path / "answer" / "index.html").read_text()
