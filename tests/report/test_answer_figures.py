"""Figures of an answer, from its tables: what remains, what is correlated, what no window tells."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from unmodelled.base.tables import write_table
from unmodelled.report.figures.correlations import correlations
from unmodelled.report.figures.evidence import MOST, evidence
from unmodelled.report.figures.files import figures_of
from unmodelled.report.figures.residual import lacking
from unmodelled.report.figures.spectrum import spectrum

PERIOD, SAMPLES, NOISE, VIBRATION = 0.01, 4096, 0.02, 12.5


def answer(folder: Path, **about: Any) -> Path:
    """A folder with about.json and the errors of one output: noise, and a vibration that nothing explains."""
    outputs = [{"name": "x", "unit": "m", "error_unit": "m", "noise": NOISE}]
    content = {"verdict": "effect", "effects": ["drag at rail"], "outputs": outputs, "horizon": 0.5, **about}
    (folder / "tables").mkdir(parents=True)
    (folder / "tables" / "about.json").write_text(json.dumps(content))
    t = PERIOD * np.arange(SAMPLES)
    error = NOISE * np.random.default_rng(0).standard_normal(SAMPLES)
    known = error + 0.5 * np.sin(2.0 * np.pi * VIBRATION * t)
    rows = {"output": "x", "t": t, "measured": 0.0 * t, "known": known, "augmented": error}
    write_table(pd.DataFrame(rows), folder / "tables" / "trajectory")
    return folder


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for axes in figure.get_axes() for text in axes.texts]


def test_a_vibration_is_a_peak_and_noise_lies_on_its_line(tmp_path: Path) -> None:
    axes = spectrum(answer(tmp_path)).axes[0]
    known, augmented, floor = (line for line in axes.lines[:3])
    frequency, density = (np.asarray(part, dtype=float) for part in known.get_data())
    assert frequency[np.argmax(density)] == pytest.approx(VIBRATION, rel=0.1)
    level = float(np.asarray(floor.get_ydata(), dtype=float)[0])
    middle = np.median(np.asarray(augmented.get_ydata(), dtype=float))
    assert level == pytest.approx(NOISE * np.sqrt(2.0 * PERIOD)) and middle == pytest.approx(level, rel=0.15)


def test_numbers_in_cells_are_the_correlations(tmp_path: Path) -> None:
    folder = answer(tmp_path)
    assert "correlations" not in figures_of(folder)
    pairs = [(a, b, 1.0 if a == b else -0.87) for a in ("k", "F_c") for b in ("k", "F_c")]
    table = pd.DataFrame(pairs, columns=["row", "column", "correlation"])
    write_table(table, folder / "tables" / "correlations")
    assert "correlations" in figures_of(folder)
    figure = correlations(folder)
    assert texts(figure) == ["1.00", "−0.87", "−0.87", "1.00"]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["k", "F_c"]


def test_evidence_shows_the_best_laws_at_every_length(tmp_path: Path) -> None:
    folder = answer(tmp_path)
    assert "evidence" not in figures_of(folder)
    laws = [f"law {k} at rail" for k in range(MOST + 3)] + ["drag at rail"]
    rows = [(law, length, k * length, 0.01 * k) for length in (2.0, 0.5) for k, law in enumerate(laws)]
    rows[0] = (laws[0], 2.0, np.nan, 0.0)
    rows = [row for row in rows if row[:2] != (laws[12], 2.0)]
    write_table(
        pd.DataFrame(rows, columns=["label", "horizon", "nats", "removed"]), folder / "tables" / "evidence"
    )
    assert "evidence" in figures_of(folder)
    short, long = (figure := evidence(folder)).axes
    assert [axes.get_title(loc="left") for axes in (short, long)] == ["windows of 0.5 s", "windows of 2 s"]
    shown = [label.get_text() for label in short.get_yticklabels()]
    assert shown[:3] == ["drag at rail", "law 11 at rail", "law 12 at rail"]
    assert len(short.patches) == len(long.patches) == MOST
    assert "26 (13 %)" in texts(figure) and "no fit" in texts(figure)


@pytest.mark.parametrize(("size", "told"), [(1e10, True), (0.3, False)])
def test_a_sensor_that_gives_the_states_is_not_drawn(size: float, told: bool, tmp_path: Path) -> None:
    axis = {"name": "x", "unit": "m"}
    channel = {"kind": "sensor", "name": "x", "unit": "m", "level": axis}
    about = {"channels": {"sensor:x": channel}, "shown": [["sensor:x", "level"]], "regions": []}
    folder, generator = answer(tmp_path, **about), np.random.default_rng(1)
    rows = pd.DataFrame({"channel": "sensor:x", "stage": ["lacking", "left"] * 100, "error": 0.01})
    rows["level"], rows["value"] = generator.uniform(0.0, 1.0, 200), size * generator.standard_normal(200)
    rows["rate"] = rows["acceleration"] = np.nan
    write_table(rows, folder / "tables" / "windows")
    law = {"channel": ["sensor:x"], "x": [0.0], "law": [0.0], "low": [0.0], "high": [0.0]}
    write_table(pd.DataFrame(law), folder / "tables" / "laws")
    figure = lacking(folder)
    assert told == any("no window tells what is missing at sensor x" in text for text in texts(figure))
    assert len(figure.get_axes()) == 1  # a single coordinate leaves no empty panel beside


def test_without_a_gap_no_effort_is_missing(tmp_path: Path) -> None:
    assert not {"lacking", "left_over"} & set(figures_of(answer(tmp_path, verdict="no_gap", effects=[])))
