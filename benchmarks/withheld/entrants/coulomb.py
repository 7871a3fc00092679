"""The smallest entrant: whatever the machine, dry friction at the first port is missing. Plain Python."""

import json
import re
import sys
from pathlib import Path

words = dict(word.partition("=")[::2] for word in sys.argv[1:])
text = Path(words["system"]).read_text()
ports = re.search(r"^ports:\n\s+(\w+):", text, re.MULTILINE)
effects = [{"family": "coulomb_friction", "port": ports[1]}] if ports else []
answer = {"verdict": "effect" if effects else "unknown", "confidence": 0.5, "effects": effects}
out = Path(words["out"])
out.mkdir(parents=True, exist_ok=True)
(out / "answer.json").write_text(json.dumps(answer))
