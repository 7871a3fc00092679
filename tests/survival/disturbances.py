"""What else than a kill can happen to a run of the graph; results stay whole, and the next run completes."""

import os
import random
import resource
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

#: Of a file, bytes: less than most results and DVC's own notes need.
LIMIT = 20_000
#: Until Ctrl-C.
SECONDS = 15.0
#: Who may read a checkout of another user, and not write to it.
NOBODY = 65534


def full_disk(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run where no file can grow; what is wrong with how it ended, if anything."""

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT))

    return _refused(command, folder, environment, preexec_fn=small)


def read_only(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run as somebody who may not write; needs a superuser."""
    if os.geteuid() != 0:
        return ""
    folder.parent.chmod(0o755)
    return _refused(command, folder, {**environment, "HOME": "/nonexistent"}, user=NOBODY, group=NOBODY)


def _refused(command: list[str], folder: Path, environment: dict[str, str], **how: Any) -> str:
    """Run what must be refused in a line; what is wrong with how it ended, if anything."""
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, **how)
    said = (done.stdout + done.stderr).decode(errors="replace")
    if done.returncode == 0:
        return "was not refused"
    if "Traceback" in said:
        return f"ended in a traceback:\n{said[-3000:]}"
    return ""


def users_folder(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Name a user's folder, and an input, as `out` of verbs that replace theirs: all files stay as they were.

    The graph (`command`) is not run: before it runs a stage, DVC itself removes what lies in its places.
    """
    mine, verb = folder / "mine", [sys.executable, "-m", "pipeline"]
    (mine / "deep").mkdir(parents=True, exist_ok=True)
    (mine / "deep" / "thesis.txt").write_text("years of work")
    acquired = [*verb, "acquire", "source=pendulum", "out=pendulum_logs"]
    subprocess.run(acquired, cwd=folder, env=environment, capture_output=True, check=True)
    before = _contents(mine, folder / "pendulum_logs")
    system = "system=systems/pendulum.yaml"
    for arguments in (
        ["acquire", "source=pendulum", "out=mine"],
        ["ingest", system, "raw=pendulum_logs", "out=pendulum_logs"],
        ["simulate", system, "logs=pendulum_logs", "out=mine/../pendulum_logs"],
        ["diagnose", system, "logs=pendulum_logs", "out=pendulum_logs/answer"],
    ):
        if flaw := _refused([*verb, *arguments], folder, environment):
            return f"{' '.join(arguments)}: {flaw}"
        if _contents(mine, folder / "pendulum_logs") != before:
            return f"{' '.join(arguments)}: files were lost or added"
    return ""


def _contents(*folders: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for f in folders for path in sorted(f.rglob("*")) if path.is_file()}


def _started(
    command: list[str], folder: Path, environment: dict[str, str], **how: Any
) -> subprocess.Popen[bytes]:
    said = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    return subprocess.Popen(command, cwd=folder, env=environment, **said, **how)


def interrupted(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Press Ctrl-C after a while; no verb says more than a line."""
    process = _started(command, folder, environment, start_new_session=True)
    try:
        said, _ = process.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
        said, _ = process.communicate()
    text = said.decode(errors="replace")
    # DVC, which ends by it as well, is not ours
    ours = 'File "' in text and ("/pipeline/" in text or "/unmodelled/" in text)
    return f"ended in a traceback:\n{text[-3000:]}" if ours else ""


def two_at_once(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run twice, side by side; one must end well, the other one too unless DVC names the one in its way."""
    both = [_started(command, folder, environment) for _ in range(2)]
    said = [process.communicate()[0].decode(errors="replace") for process in both]
    failed = [text for text, process in zip(said, both, strict=True) if process.returncode]
    refused = [text for text in failed if "is being blocked by" in text and "Traceback" not in text]
    return "" if failed == refused and len(failed) < 2 else "\n".join(text[-3000:] for text in failed)


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


ALL = (full_disk, read_only, interrupted, two_at_once, users_folder)
