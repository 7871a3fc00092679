"""Run every benchmark and write reports/metrics/benchmarks.json."""

from __future__ import annotations

import importlib
import pkgutil
import time
from pathlib import Path

import torch

import benchmarks
from pipeline.files import write_json
from pipeline.revision import revision

HARNESS = {"timing", "__main__"}


def main() -> None:
    """One object per benchmark: ours and peer in seconds, their ratio, the peer's version, threads."""
    start = time.monotonic()
    results: dict[str, object] = {"data": "virtual", "profile": "-", "revision": revision()}
    for module in sorted(m.name for m in pkgutil.iter_modules(benchmarks.__path__) if m.name not in HARNESS):
        benchmark = importlib.import_module(f"benchmarks.{module}")
        numbers = benchmark.run()
        results[module] = {**numbers, "peer_version": benchmark.PEER, "threads": torch.get_num_threads()}
        spread = f"({numbers['ratio_low']:.1f} to {numbers['ratio_high']:.1f})"
        print(f"{module:<12} {numbers['ratio']:6.1f} x the speed {spread} of {benchmark.PEER}")
    results["seconds"] = time.monotonic() - start
    write_json(Path(__file__).parent.parent / "reports" / "metrics" / "benchmarks.json", results)


if __name__ == "__main__":
    main()
