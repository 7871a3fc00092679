"""Build the tables on the page of a diagnosis from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from unmodelled.base.sure_numbers import as_said, interval_of, remark
from unmodelled.base.wording import effect_name, effect_names, law_name, place_name
from unmodelled.report.numbers import amounts, quantity, short
from unmodelled.report.tables import Cell, Table, number_cell, unit_cell

GAPS = {
    "known": ("as given", "the system file without changes"),
    "reidentified": ("re-identified", "the system file with its uncertain parameters refitted"),
    "augmented": ("with the effects found", "with the diagnosed effects, all uncertain parameters refitted"),
    "neural": ("with networks", "with a network in every port: reference for a flexible model"),
    "floor": ("noise", "noise floor: the gap that sensor noise alone causes"),
    "persistence": ("persistence", "prediction that every output keeps its value or its speed"),
}
#: Standard errors beyond which a difference is no chance.
SURE = 2.0
#: Robot files whose free runs in MuJoCo are compared.
ROBOT_FILES = {
    "given": "the robot file as given",
    "patched": "the patched file",
    "supplemented": "the patched file with its supplement",
}


def parameter_tables(content: Mapping[str, Any]) -> list[Table]:
    """Return the parameters of every identified law, one table per effect."""
    found = []
    for k, effect in enumerate(content["effects"], start=1):
        rows = []
        for name, given in effect["parameters"].items():
            entry = as_said(given)
            value, interval = quantity(entry["value"], interval_of(entry))
            note = f"one value for each of {len(entry['values'])} experiments" if "values" in entry else ""
            note = "; ".join(filter(None, (entry.get("words"), note, remark(given))))
            symbol = entry.get("symbol", name).replace("*", "·")
            named, range_ = Cell(symbol, name, note=note), Cell(interval or "–", interval)
            rows.append((named, _value(value, entry["value"]), range_, unit_cell(entry["unit"])))
        columns = "Number", "Value", "95 % interval", "Unit"
        found.append(
            Table(f"effect_{k}", f"Numbers of {effect_name(effect)}", columns, _numeric("0100"), tuple(rows))
        )
    return found


def gap_table(content: Mapping[str, Any]) -> Table:
    """Return the gaps of experiments left out."""
    gap = content["gap"]
    rows = [
        (Cell(label, name), number_cell(gap[name]), Cell(meaning, meaning, "small"))
        for name, (label, meaning) in GAPS.items()
        if name in gap and (name != "augmented" or content["effects"])
    ]
    about = (
        "Root mean square over free-run windows, in standard deviations of the outputs, on experiments that "
        "are left out of the fit, each once."
    )
    columns = "Model", "Gap", "Description"
    return Table("gaps", "Gap of experiments left out", columns, _numeric("010"), tuple(rows), about)


def units_table(content: Mapping[str, Any]) -> Table:
    """Return the errors of experiments left out in units of the outputs."""
    rows, exact, gap = list[tuple[Cell, ...]](), list[tuple[str, ...]](), content["gap"]
    label = "With the effects found" if content["effects"] else "Re-identified"
    models = {"known": "As given", "augmented": label}
    if content["verdict"] == "check_logs":
        del models["augmented"]
    near = amounts([gap["horizon"]], "s", 3)[0] if "horizon" in gap else "horizon"
    spans = {near: "", "whole run": "_whole_run"}
    for name, given in gap.get("units", {}).items():
        entry = as_said(given)
        for span, key in spans.items():
            cells = _amounts([entry[f"{model}{key}"] for model in models], entry["unit"])
            rows.append((Cell(name, name), Cell(span, span), *cells))
            exact.append((*(cell.exact for cell in rows[-1]), entry["unit"]))
    columns = ("Output", "After", *models.values())
    about = (
        "Root mean square errors of experiments left out: at the last sample of the free-run windows, and "
        "over all samples of whole experiments, simulated from their first state."
    )
    numeric = _numeric("00" + "1" * len(models))
    download = ((*columns, "Unit"), *exact) if rows else ()
    return Table("errors", "Errors of every output", columns, numeric, tuple(rows), about, download=download)


def where_tables(content: Mapping[str, Any], units: Mapping[str, str]) -> list[Table]:
    """Return the tables of channels, regions and factors that have rows."""
    where = content["where"]
    channels = [(Cell(row["port"], row["port"]), _share(row["share"])) for row in where["channels"]]
    regions = [
        (
            *(Cell(row["signal"], row["signal"]), number_cell(row["low"]), number_cell(row["high"])),
            *(unit_cell(units.get(row["signal"], "")), _share(row["share"])),
        )
        for row in where["regions"]
    ]
    factors = [
        (Cell(row["factor"], row["factor"]), number_cell(row["level"]), _share(row["share"]))
        for row in where["factors"]
    ]
    squares = "Share of the squared gap above the noise floor, by the channel where it enters."
    tables = [
        Table("channels", "Channels", ("Channel", "Share"), _numeric("01"), tuple(channels), squares),
        Table(
            *("regions", "Regions", ("Signal", "From", "To", "Unit", "Share"), _numeric("01101")),
            tuple(regions),
            "Regions of a signal with a much larger share of the gap than of the samples.",
        ),
        Table(
            *("factors", "Operating point", ("Factor", "Level", "Share"), _numeric("001"), tuple(factors)),
            "Levels of a factor with a larger share of the gap than of the samples.",
        ),
    ]
    return [table for table in tables if table.rows]


def _amounts(values: Sequence[float | None], unit: str) -> list[Cell]:
    """Cells of errors with their unit, all with the same prefix; a simulation that diverges has none."""
    shown = iter(amounts([value for value in values if value is not None], unit, 3))
    return [Cell("diverges", "") if v is None else Cell(next(shown), str(v)) for v in values]


def experiments_table(content: Mapping[str, Any]) -> Table:
    """Return the gaps of all experiments."""
    fitted = content["verdict"] != "check_logs"
    rows = [
        (
            Cell(row["id"], row["id"]),
            *(number_cell(row[name]) for name in (("known", "augmented") if fitted else ("known",))),
        )
        for row in content["where"]["experiments"]
    ]
    after = "With the effects found" if content["effects"] else "Re-identified"
    columns = ("Experiment", "As given", *([after] if fitted else []))
    flags = _numeric("01" + "1" * fitted)
    return Table("experiment_gaps", "Gap of every experiment", columns, flags, tuple(rows))


def identified_table(content: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return the uncertain parameters of the system, as given and identified."""
    rows = []
    for name, entry in content["parameters"].items():
        value, interval = quantity(entry["identified"], interval_of(entry))
        cells = (
            Cell(name, name, note=remark(entry)),
            number_cell(entry["known"]),
            _value(value, entry["identified"]),
        )
        rows.append((*cells, Cell(interval or "–", interval), unit_cell(units.get(name, ""))))
    columns = "Parameter", "In the file", "Identified", "95 % interval", "Unit"
    return Table("parameters", "Uncertain parameters", columns, _numeric("01100"), tuple(rows))


def comparison_table(content: Mapping[str, Any]) -> Table:
    """Return all models that were fitted, with their errors in units, and why each is not the named one."""
    every = content["comparison"]
    outputs = list(dict.fromkeys(name for row in every for name in row.get("errors", ())))
    named = next((row for row in every if row["named"]), None)
    rows = []
    for row in every:
        name, errors = effect_names(row["effects"]), row.get("errors", {})
        cells = [
            Cell(amounts([errors[o]["value"]], errors[o]["unit"], 3)[0], str(errors[o]["value"]))
            if o in errors and errors[o]["value"] is not None
            else Cell("–", "")
            for o in outputs
        ]
        likely = row.get("probability")
        share = number_cell(None) if likely is None else _probability(likely)
        why = _why(row, named, content)
        numbers = (number_cell(row[key]) for key in ("difference", "standard_error"))
        rows.append((Cell(name, name), share, *cells, Cell(why, why, "small"), *numbers))
    lengths = {row["horizon"] for row in every if row.get("horizon")}
    over = f" over windows of {amounts([min(lengths)], 's', 3)[0]}" if len(lengths) == 1 else ""
    about = (
        f"Errors are root mean squares of free runs{over}, refitted with the law. The difference is that of "
        "the predictions of experiments left out from those of the named model, in nats per independent "
        "sample, with its standard error over experiments; a positive one is a worse prediction."
    )
    of_outputs = (f"Error of {o}" for o in outputs)
    columns = "Model", "Probability", *of_outputs, "Why it is not the one", "Difference", "Standard error"
    numeric = _numeric("01" + "1" * len(outputs) + "011")
    return Table("models", "Why this one: all models that were fitted", columns, numeric, tuple(rows), about)


def _probability(share: float) -> Cell:
    return Cell("below 0.1 %" if share < 0.0005 else f"{100.0 * share:.1f} %", str(share))


def _why(row: Mapping[str, Any], named: Mapping[str, Any] | None, content: Mapping[str, Any]) -> str:
    """Why a model is not the one that the answer names."""
    if row["named"] or named is None:
        return "named" if row["named"] and content["effects"] else "nothing is named" if row["named"] else ""
    label = effect_name(row["effects"][-1]) if row["effects"] else ""
    alike = {effect_name(o) for effect in content["effects"] for o in effect["indistinguishable"]}
    if label in alike:
        return "these logs cannot tell it from the named one, which is plainer or explains more"
    if {effect_name(one) for one in row["effects"]} < {effect_name(one) for one in named["effects"]}:
        return "leaves out a named effect, and predicts experiments left out worse"
    difference, error = row["difference"], row["standard_error"] or 0.0
    if difference > SURE * error:
        return "predicts experiments left out worse, by more than chance"
    if difference > 0.0:
        return "predicts experiments left out no better"
    beyond = "more than chance" if -difference > SURE * error else "no more than chance"
    return f"predicts experiments left out better by {beyond}, but pays more for its numbers"


def chain_table(content: Mapping[str, Any]) -> Table:
    """Return the parts of the measurement chain that pay."""
    rows = []
    for part in content.get("chain", ()):
        entry, law = as_said(part), law_name(part["family"], part.get("variant", ""))
        each = "size of the deviations of experiments, one standard deviation"
        named = Cell(law, part["family"], note=each if part["per_experiment"] else "")
        numbers = (_rounded(entry[key]) for key in ("value", "error"))
        place = Cell(place_name(part["channel"]), part["channel"])
        rows.append((named, place, *numbers, unit_cell(entry["unit"])))
    columns = "Part", "At", "Value", "Standard error", "Unit"
    about = "Numbers of drives, sensors and logger that were fitted to all experiments beside the physics."
    return Table("chain_parts", "Measurement chain", columns, _numeric("00110"), tuple(rows), about)


def evidence_table(content: Mapping[str, Any]) -> Table:
    """Return the evidence of every refitted law, the best first."""
    entries = sorted(content.get("evidence", ()), key=lambda one: (one["horizon"], *_last(one["nats"])))
    rows = []
    for one in entries:
        name, removed = effect_name(one), one["removed"]
        share = _share(removed) if removed is not None else number_cell(None)
        cells = (number_cell(one["horizon"]), _rounded(one["nats"]), share)
        rows.append((Cell(name, name), *cells))
    about = (
        "Log evidence over the fit without the law, after the price of its numbers, and the share of the "
        "squared residual that the law removes, of the output where the share is largest. Nats compare "
        "within one length of the windows only."
    )
    columns = "Law", "Windows (s)", "Evidence (nats)", "Removed"
    return Table("law_evidence", "Evidence of laws", columns, _numeric("0111"), tuple(rows), about)


def changes_table(robot: Mapping[str, Any]) -> Table:
    """Return the numbers that the patched robot file changes."""
    rows = []
    for change in robot["changes"]:
        name = f"{change['element']}.{change['quantity']}"
        numbers = (number_cell(change[key], "none") for key in ("given", "patched"))
        rows.append((Cell(name, name), *numbers, unit_cell(change["unit"])))
    columns = "Number", "As given", "Patched", "Unit"
    about = "The equations have no dry friction of the robot file: frictionloss is what the diagnosis found."
    return Table("robot_changes", "Numbers of the robot file", columns, _numeric("0110"), tuple(rows), about)


def replay_table(robot: Mapping[str, Any], held_out: list[str], horizon: float) -> Table:
    """Return the errors of the robot files in MuJoCo; horizon in s."""
    runs = {name: label for name, label in ROBOT_FILES.items() if name in robot["replay"]}
    rows: list[tuple[Cell, ...]] = []
    for name, label in runs.items():
        gap = number_cell(robot["replay"][name]["gap"])
        rows.append((Cell("gap", "gap"), Cell(label, name), gap, Cell("–", ""), Cell("–", "1")))
    for output in robot["replay"]["given"]["units"]:
        for name, label in runs.items():
            entry = robot["replay"][name]["units"][output]
            errors = (number_cell(entry[key], "diverges") for key in ("at_horizon", "whole_run"))
            rows.append((Cell(output, output), Cell(label, name), *errors, unit_cell(entry["unit"])))
    about = (
        f"Root mean square errors on {', '.join(map(str, held_out))}, which took no part in fitting: the gap "
        f"over windows of {amounts([horizon], 's', 3)[0]} in standard deviations of the outputs, and the "
        "errors of every output at the end of the windows and over whole runs."
    )
    columns = "Output", "In MuJoCo", f"After {amounts([horizon], 's', 3)[0]}", "Whole run", "Unit"
    return Table("robot_replay", "The robot file in MuJoCo", columns, _numeric("00110"), tuple(rows), about)


def robot_sentence(robot: Mapping[str, Any]) -> str:
    """Return how well the patched file follows the machine, beside the file as given."""
    replay = robot["replay"]
    name = "supplemented" if "supplemented" in replay else "patched"
    given = replay["given"]["gap"]
    gaps = f"{short(given)} as given and {short(replay[name]['gap'])} with {ROBOT_FILES[name]}"
    lost = [output for output, entry in replay[name]["units"].items() if entry["whole_run"] is None]
    diverges = f" In whole runs, {', '.join(lost)} diverges." if lost else ""
    worse = replay["patched"]["gap"] >= given
    alone = " The patched file alone is no improvement: load it with its supplement." if worse else ""
    return f"In MuJoCo, the gap of all experiments is {gaps}.{diverges}{alone}"


def _numeric(flags: str) -> tuple[bool, ...]:
    return tuple(flag == "1" for flag in flags)


def _value(text: str, exact: Any) -> Cell:
    return Cell(text, "" if exact is None else str(exact), "figure")


def _last(nats: float | None) -> tuple[bool, float]:
    """Key that sorts by evidence, the most first; laws whose fit failed come last."""
    return (True, 0.0) if nats is None else (False, -nats)


def _rounded(value: float | None) -> Cell:
    """Cell of a number with three significant digits, and all of them in the file."""
    return Cell(short(value), "" if value is None else str(value))


def _share(value: float) -> Cell:
    return Cell(f"{100.0 * value:.3g} %", str(value))
