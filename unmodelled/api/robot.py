"""Patched robot files in MuJoCo, with what their format cannot say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from unmodelled.engine.robot.supplement import Callback, Supplement


def supplement(model: Any, path: Path | str) -> Callback:
    """Complete a model of MuJoCo with the supplement of a patched robot file.

    The numbers of the supplement are set in the model. Its forces are expressions that are read as those of a
    system file; nothing is executed.

    Args:
        model: `mujoco.MjModel` of the patched file.
        path: supplement, `answer/robot/<file>_supplement.json` of a diagnosis.

    Returns:
        Function of model and data that adds the forces, for `mujoco.set_mjcb_passive`.

    Raises:
        BadInput: when the file is no supplement, or belongs to another robot.

    Examples:
        >>> import json, mujoco
        >>> from tempfile import TemporaryDirectory
        >>> import unmodelled as um
        >>> cart = '''<mujoco><worldbody><body><joint name="rail" type="slide"/><geom size="0.1"/></body>
        ...   </worldbody></mujoco>'''
        >>> model = mujoco.MjModel.from_xml_string(cart)
        >>> content = {"schema": "supplement/1", "forces": {"rail": "-k*qd_rail**2"}, "values": {"k": 3.0}}
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder, "cart_supplement.json")
        ...     path.write_text(json.dumps(content)) > 0
        ...     mujoco.set_mjcb_passive(um.supplement(model, path))
        True
        >>> data = mujoco.MjData(model)
        >>> data.qvel[0] = 2.0
        >>> mujoco.mj_forward(model, data)
        >>> data.qfrc_passive[0].item()
        -12.0
        >>> mujoco.set_mjcb_passive(None)
    """
    return Supplement.read(Path(path)).complete(model, str(path))
