"""Nouns never import verbs; layers import downwards only."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_import_contracts() -> None:
    lint = Path(sys.executable).with_name("lint-imports")
    result = subprocess.run([lint], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


def test_nothing_in_the_package_evaluates_text() -> None:
    for path in (ROOT / "pipeline").rglob("*.py"):
        text = path.read_text()
        for word in ("eval(", "exec(", "sympify(", "parse_expr(", "yaml.load(", "pickle"):
            assert f" {word}" not in text and f".{word}" not in text.replace("model.eval(", ""), (path, word)
