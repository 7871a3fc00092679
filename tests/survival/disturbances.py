"""What else than a kill can happen to a run of the graph; results stay whole, and the next run completes."""

from __future__ import annotations

import os
import random
import resource
import subprocess
from pathlib import Path

#: Of a file, bytes: less than most results and DVC's own notes need.
LIMIT = 20_000
#: Who may read a checkout of another user, and not write to it.
NOBODY = 65534


def full_disk(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run where no file can grow; what is wrong with how it ended, if anything."""

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT))

    return _refused(
        subprocess.run(command, cwd=folder, env=environment, capture_output=True, preexec_fn=small)
    )


def read_only(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run as somebody who may not write; needs a superuser."""
    if os.geteuid() != 0:
        return ""
    folder.parent.chmod(0o755)
    done = subprocess.run(
        command,
        cwd=folder,
        env={**environment, "HOME": "/nonexistent"},
        capture_output=True,
        user=NOBODY,
        group=NOBODY,
    )
    return _refused(done)


def _refused(done: subprocess.CompletedProcess[bytes]) -> str:
    said = (done.stdout + done.stderr).decode(errors="replace")
    if done.returncode == 0:
        return "was not refused"
    if "Traceback" in said:
        return f"ended in a traceback:\n{said[-3000:]}"
    return ""


def two_at_once(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run twice, side by side; both must end well."""
    both = [
        subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        for _ in range(2)
    ]
    said = [process.communicate()[0].decode(errors="replace") for process in both]
    failed = [text for text, process in zip(said, both, strict=True) if process.returncode]
    return "\n".join(text[-3000:] for text in failed)


def damage_cache(folder: Path, seed: int, count: int = 10) -> int:
    """Flip a bit in some files of DVC's cache, and give how many."""
    chance = random.Random(seed)
    known = sorted(p for p in (folder / ".dvc" / "cache").rglob("*") if p.is_file() and p.stat().st_size)
    chosen = chance.sample(known, min(count, len(known)))
    for path in chosen:
        content = bytearray(path.read_bytes())
        content[chance.randrange(len(content))] ^= 1
        path.chmod(0o644)
        path.write_bytes(content)
        path.chmod(0o444)
    return len(chosen)
