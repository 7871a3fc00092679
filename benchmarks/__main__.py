"""Run every benchmark and write reports/metrics/benchmarks.json, or run those named and only print them."""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import time
from pathlib import Path

import torch

import benchmarks
from benchmarks.timing import PeerMissing
from pipeline.files import write_json
from pipeline.revision import revision

HARNESS = {"timing", "slider_crank", "keras", "__main__"}
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
    results: dict[str, object] = {"data": "virtual", "profile": "-", "revision": revision()}
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
    results["seconds"] = time.monotonic() - start
    if not names:
        write_json(Path(__file__).parent.parent / "reports" / "metrics" / "benchmarks.json", results)


if __name__ == "__main__":
    main()
