"""Run every benchmark and write reports/*/benchmarks.*, or run those named and only print them."""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import torch

import benchmarks
from benchmarks.timing import PeerMissing
from pipeline.chapters.readable import write_table
from pipeline.revision import revision
from unmodelled.base.files import write_json

REPORTS = Path(__file__).parent.parent / "reports"
HARNESS = {"timing", "slider_crank", "keras", "head_to_head", "published", "__main__"}
COMMON = {"ours", "peer", "ratio", "ratio_low", "ratio_high", "peer_version", "threads"}


def main() -> None:
    """One object per benchmark: ours and peer in seconds, their ratio, the peer's version, threads, and more.

    A benchmark whose peer is not installed is left out.
    """
    known = sorted(m.name for m in pkgutil.iter_modules(benchmarks.__path__) if m.name not in HARNESS)
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"all, or some of: {', '.join(known)}")
    names = parser.parse_args().names
    if unknown := set(names) - set(known):
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}")
    start = time.monotonic()
    results: dict[str, dict[str, Any]] = {}
    for module in names or known:
        benchmark = importlib.import_module(f"benchmarks.{module}")
        try:
            numbers = benchmark.run()
        except PeerMissing as missing:
            print(f"{module:<16} skipped: {missing}")
            continue
        numbers = {"peer_version": benchmark.PEER, "threads": torch.get_num_threads(), **numbers}
        results[module] = numbers
        spread = f"({numbers['ratio_low']:.1f} to {numbers['ratio_high']:.1f})"
        own = "".join(f", {name} {value:.3g}" for name, value in numbers.items() if name not in COMMON)
        print(f"{module:<16} {numbers['ratio']:6.1f} x the speed {spread} of {numbers['peer_version']}{own}")
    if not names:
        took = time.monotonic() - start
        about = {"data": "virtual", "profile": "-", "revision": revision(), "seconds": took}
        write_json(REPORTS / "metrics" / "benchmarks.json", {**about, **results})
        protocol = f"ours and the peer in turn in one run, medians; at {about['revision']}"
        title = "Seconds for the same work, and how many times as fast as the peer"
        write_table(REPORTS / "tables" / "benchmarks", table(results), None, title, protocol, "virtual")


def table(results: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """A row per benchmark, the largest ratio first: work, peer, ratio peer / ours, seconds of both."""
    rows = [
        {
            "work": str(importlib.import_module(f"benchmarks.{name}").__doc__).splitlines()[0].rstrip("."),
            "peer": of["peer_version"],
            "times as fast": of["ratio"],
            "lowest": of["ratio_low"],
            "highest": of["ratio_high"],
            "ours (s)": of["ours"],
            "peer (s)": of["peer"],
            "threads": of["threads"],
        }
        for name, of in sorted(results.items(), key=lambda item: -item[1]["ratio"])
    ]
    return pd.DataFrame(rows)


if __name__ == "__main__":
    main()
