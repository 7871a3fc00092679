"""Which runs are explained, and attributions as tables."""

import numpy as np
import pandas as pd
import pytest

from pipeline.attribution import tables
from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.result import players
from pipeline.attribution.tables import Choice
from pipeline.figures.jumps.contributions import explanation
from tests.attribution.problems import inputs_of, random_network, random_runs
from unmodelled.base.errors import BadInput

SIZES = {"explained_runs": 3, "references": 4, "exact_runs": 2, "exact_references": 2}
TRAIN, TEST = np.arange(20), np.arange(20, 40)


def experiments() -> pd.DataFrame:
    generator = np.random.default_rng(0)
    label = np.tile(["contact", "jump"], 20)
    return pd.DataFrame({"label": label, "samples": generator.permutation(40) + 50})


def test_jumps_are_explained_by_contact_runs_that_were_trained_on() -> None:
    table = experiments()
    chosen = Choice.of(table, TRAIN, TEST, SIZES, 0)
    assert len(chosen.runs) == 3 and set(chosen.runs) <= set(TEST)
    assert set(table["label"].iloc[chosen.runs]) == {"jump"}
    assert len(set(chosen.references)) == 4 and set(chosen.references) <= set(TRAIN)
    assert set(table["label"].iloc[chosen.references]) == {"contact"}
    # every step of a run needs a reference that lasts as long
    contact = table.iloc[TRAIN][lambda t: t["label"] == "contact"]
    assert chosen.references[0] == chosen.exact_references[0] == contact["samples"].idxmax()
    assert set(chosen.exact_runs) < set(chosen.runs) and set(chosen.exact_references) < set(chosen.references)
    again, other = (Choice.of(table, TRAIN, TEST, SIZES, seed) for seed in (0, 1))
    assert again.runs.tolist() == chosen.runs.tolist() != other.runs.tolist()


@pytest.mark.parametrize(("label", "message"), [("jump", "no contact run"), ("contact", "no jump run")])
def test_nothing_to_explain_or_to_refer_to(label: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        Choice.of(experiments().assign(label=label), TRAIN, TEST, SIZES, 0)


def test_players_are_whole_groups_and_single_names() -> None:
    groups = {"theta": ["sin", "cos"], "cam": ["h", "dh"]}
    expected = {"theta": ["sin", "cos"], "omega": ["omega"], "h": ["h"]}
    assert players(["sin", "omega", "cos", "h"], groups) == expected


def test_tables_hold_the_attributions() -> None:
    inputs = inputs_of(3, 1)
    network = random_network(inputs, 0)
    runs, background = random_runs(inputs, [6, 4], 1), random_runs(inputs, [7, 5], 2)
    found = deep_shap(network, runs, background)
    shares = tables.run_shares(found)
    assert shares.groupby("exp")["share"].sum().to_numpy() == pytest.approx(1.0)
    first = shares[shares["exp"] == runs.runs[0]].set_index("feature")["magnitude"]
    np.testing.assert_allclose(first[["x0", "x1", "x2", "q0"]], np.abs(found[0].phi).sum(1))
    overall = tables.overall_shares(found).set_index("feature")["share"]
    sums = shares.groupby("feature")["magnitude"].sum()
    np.testing.assert_allclose(overall.sort_index(), sums.sort_index() / sums.sum())
    accuracy = tables.accuracies(found)
    assert accuracy["steps"].tolist() == [6, 4] and (accuracy["error"] < 1e-12).all()
    phi, explained = tables.trajectories(found)
    own = phi[(phi["exp"] == runs.runs[1]) & (phi["feature"] == "x2")]
    np.testing.assert_array_equal(own["phi"], found[1].phi[2])
    assert own["step"].tolist() == [0, 1, 2, 3] and len(explained) == 10
    exact, agreement = tables.against_exact(network, runs, background, {"pair": ["x0", "x1"]})
    assert set(exact["feature"]) == {"pair", "x2", "q0"} and set(exact["method"]) == {"deep_shap", "exact"}
    assert agreement["exp"].tolist() == list(runs.runs) and agreement["shares"].between(-1, 1).all()


def test_an_explanation_of_shap_holds_the_attributions() -> None:
    inputs = inputs_of(3, 1)
    runs, background = random_runs(inputs, [6, 4], 1), random_runs(inputs, [7, 5], 2)
    found = deep_shap(random_network(inputs, 0), runs, background)
    made = explanation(tables.points(found, runs, every=1), 1e3)
    np.testing.assert_array_equal(made.values, 1e3 * np.concatenate([a.phi.T for a in found]))
    outputs = np.concatenate([a.output for a in found])
    np.testing.assert_allclose(made.base_values + made.values.sum(1), 1e3 * outputs, rtol=1e-12)
    assert made.feature_names == ["x0", "x1", "x2", "q0"]
    np.testing.assert_array_equal(made.data[:6, :3], runs.features[0])
    np.testing.assert_array_equal(made.data[6:, 3], np.full(4, runs.settings[1, 0]))
    few = tables.points(found, runs, every=4)
    assert few[few["feature"] == "x0"]["step"].tolist() == [0, 4, 0]


def test_an_attribution_of_nothing_has_no_shares() -> None:
    inputs = inputs_of(1, 0)
    runs = random_runs(inputs, [4], 1)
    shares = tables.run_shares(deep_shap(random_network(inputs, 0), runs, runs))
    assert shares["share"].tolist() == [0.0]
