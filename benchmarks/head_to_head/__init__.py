"""Head to head: other methods and `unmodelled.diagnose` on the same logs, split and measure of error.

`python -m benchmarks.head_to_head` fits every method to every machine, on the same experiments, and judges
all of them on the same held-out experiments by the same gap. Results: docs/head_to_head.
"""
