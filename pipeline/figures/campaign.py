"""Draw overviews of a whole campaign from its table of experiments."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.chapters.boundary import measured
from pipeline.figures.examples import experiments_of, levels
from pipeline.figures.panels import boundary_line, cells, finish_map, map_grid
from pipeline.figures.settings import LABELS
from unmodelled.report.figures.style import BLACK, new_figure

#: Trajectories are cut to this many samples before a recurrent network learns from them (section 5.4.2).
TRUNCATION = 4000


def label_map(data: Path) -> Figure:
    """Contact, follower jump or stall at every voltage and follower mass, in a panel for every cam.

    Jumps begin at a lower voltage for a higher stroke and for a shorter fall, that is, a larger angle beta
    of the rise. A very short rise brings them forward too: the follower then leaves the cam before the
    crest. Steep cams stall where the voltage is low.
    """
    experiments = experiments_of(data, "trajectories")
    figure, panels = map_grid(experiments)
    kinds = ("contact", "jump")
    number = experiments["label"].map({kind: float(i) for i, kind in enumerate(kinds)}).to_numpy(np.float64)
    cells(panels, experiments, number, ListedColormap([LABELS[kind] for kind in kinds]), Normalize(0, 1))
    counts = experiments["label"].value_counts()
    patches = [
        Patch(color=colour, label=f"{kind} ({counts.get(kind, 0)} runs)") for kind, colour in LABELS.items()
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=3)
    return figure


def sequence_lengths(data: Path) -> Figure:
    """Lengths of the measured sequences, in samples at the logged rate.

    A run ends after about the same number of revolutions, so that fast runs, which jump, are short. What lies
    to the right of the line is cut off when a recurrent network learns from these sequences.
    """
    experiments = experiments_of(data, "trajectories")
    samples = experiments["samples"].to_numpy(np.float64)
    bins = np.arange(0.0, max(samples.max(), 1.5 * TRUNCATION) + 500.0, 500.0)
    figure = new_figure(3.6)
    axes = figure.subplots()
    groups = [samples[experiments["label"] == kind] for kind in LABELS]
    names = [f"{kind} ({len(group)} runs)" for kind, group in zip(LABELS, groups, strict=True)]
    axes.hist(
        groups,
        bins=bins.tolist(),
        stacked=True,
        color=list(LABELS.values()),
        label=names,
        edgecolor="white",
        linewidth=0.5,
    )
    axes.axvline(TRUNCATION, color=BLACK, linewidth=1.5)
    axes.annotate(
        f"{TRUNCATION} samples: {np.mean(samples > TRUNCATION):.0%} of the runs are longer",
        (TRUNCATION, 0.97),
        xycoords=("data", "axes fraction"),
        xytext=(6, 0),
        textcoords="offset points",
        va="top",
    )
    rate = float((samples / experiments["duration"]).median()) / 1e3
    axes.set(
        xlabel=f"length of the sequence (samples at {rate:.2g} kHz)",
        ylabel="number of runs (-)",
        xlim=(0.0, bins[-1]),
    )
    axes.legend(loc="center right")
    return figure


def bifurcation_map(data: Path) -> Figure:
    """Largest detachment per revolution as a share of the stroke, and the measured boundary Q of the jumps.

    The line is where the share rises through the threshold of a jump (black mark in the colour bar). Left of
    it there are vibration and noise only; to its right the detachment grows tenfold within a few volts.
    """
    experiments, bench = experiments_of(data, "trajectories"), CamFollower()
    figure, panels = map_grid(experiments)
    share = 100.0 * experiments["eps_share"].to_numpy(np.float64)
    share[~(share > 0.0) | (experiments["label"] == "stall").to_numpy()] = np.nan
    threshold = 100.0 * bench.jump_share
    found = share[np.isfinite(share)]
    norm = LogNorm(
        min(found.min(initial=threshold), 0.1 * threshold), max(found.max(initial=threshold), 10 * threshold)
    )
    mesh = cells(panels, experiments, share, mpl.colormaps["viridis_r"], norm)
    line = boundary_line(
        panels, measured(experiments, bench.jump_share), levels(experiments, "m"), "measured boundary Q"
    )
    bar = finish_map(figure, panels, mesh, line, "$ε_{max}$ / H (%)")
    bar.ax.axhline(threshold, color=BLACK, linewidth=1.8)
    return figure
