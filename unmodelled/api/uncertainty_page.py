"""The page of an identified distribution, with the machine where there is one."""

from __future__ import annotations

from pathlib import Path

from unmodelled.api.simulation import simulate
from unmodelled.diagnosis.answer.live_machine import about_machine, simulated
from unmodelled.diagnosis.answer.live_numbers import values_of
from unmodelled.learning.uncertainty.identified import IdentifiedUncertainty
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.systems.given import SystemGiven


def write_page(
    found: IdentifiedUncertainty,
    folder: Path,
    system: SystemGiven | None = None,
    logs: LogsGiven | None = None,
) -> None:
    """Write index.html to the folder of a result.

    Args:
        found: identified distribution.
        folder: folder that `found` was saved to.
        system: system whose parameters scatter, or the path of its file; default None: there is no machine in
            the page.
        logs: measured experiments of the system, or the path of their folder; default None.

    Raises:
        BadInput: when the file cannot be written.
    """
    # load matplotlib and the templates
    from unmodelled.report.figures.results import observations, profile_likelihoods
    from unmodelled.report.figures.style import svg
    from unmodelled.report.result_pages import write_uncertainty_page

    best = found.most_likely
    figures = {
        "profiles": svg(profile_likelihoods(found.profiles, best)),
        "observations": svg(observations(found.points, found.content["unit"] or "")),
    }
    rows = found.estimates.to_dict("records")
    if system is None or logs is None:
        write_uncertainty_page(folder, found.content, rows, figures, None, None)
        return
    known, measured = read_inputs(system, logs)
    mean_of = {name: f"mu_{k}" for k, name in enumerate(found.content["parameters"], start=1)}
    scattered = [p for p in known.parameters if mean_of.get(p.name) in best]
    means = {p.name: p.value * best[mean_of[p.name]] for p in scattered}
    run, mean = simulate(known, measured), known.with_values(means)
    live = simulated(known, measured, run.runs, run.horizon, run.gap)
    live["identified"] = values_of(list(mean.values), mean, measured)
    write_uncertainty_page(folder, found.content, rows, figures, live, about_machine(known))
