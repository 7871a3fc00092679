"""Calibrate the confidence of diagnoses on cases with known faults."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pandas as pd

from pipeline.withheld.answers import answers
from pipeline.withheld.weights import fitted_weights
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.ownership import Out, verb
from unmodelled.diagnosis.decide.confidence import Signs


@verb(Out.FILE)
def calibrate_withheld(cases: Path, diagnoses: Path, refits: Path, out: Path) -> None:
    """Write the weights of `confidence` to the file `out`, from cases that no reported number uses.

    Args:
        cases: folder of campaigns of withheld cases, one kind per campaign.
        diagnoses: folder written by diagnose_withheld.
        refits: folder written by refit_withheld.
        out: JSON file; diagnoses read unmodelled/diagnosis/decide/calibration.json.

    Raises:
        BadInput: when an input is missing, or a verdict does not occur.
    """
    signs = [sign.name for sign in fields(Signs)]
    rows = []
    for place, said, row in answers(cases, diagnoses, refits):
        if said["verdict"] == "check_logs":  # its confidence is the share that the fault explains
            continue
        shown = said.get("signs", {})
        if missing := [name for name in signs if not isinstance(shown.get(name), int | float)]:
            raise BadInput(f"{diagnoses / place}.json: signs.{missing[0]}: must be a number")
        rows.append({"verdict": said["verdict"], "right": row["right"], **shown})
    table = pd.DataFrame(rows)
    for verdict in ("effect", "main_effect", "no_gap", "unknown"):
        if verdict not in set(table["verdict"]):
            raise BadInput(f"{diagnoses}: no case has the verdict {verdict}: weights need all of them")
    write_json(out, fitted_weights(table, signs))
    print(table.groupby("verdict")["right"].agg(["size", "mean"]).to_string())
