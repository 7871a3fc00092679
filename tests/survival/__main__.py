"""Kill the whole graph at random, disturb it otherwise, compare its metrics with those of an undisturbed run.

    python -m tests.survival [--kills 30] [--seed 0] [--longest 40] [--target <stage>] [--folder <keep here>]

After the kills: a full disk, a folder that is read-only, Ctrl-C, two runs at once, a user's folder named as
`out`, damaged files in the cache. Exit code 0: after each of them all results were whole, no rerun needed
help, and the metrics are the same.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.graph.tiny import write_project
from tests.survival import disturbances
from tests.survival.inspection import differences, half_written, metrics, results

#: Shortest time until a kill, s.
SHORTEST = 0.5


class Project:
    """A copy of the checkout with a tiny campaign, and the command that makes its report."""

    def __init__(self, folder: Path, target: str | None) -> None:
        self.folder = write_project(folder)
        venv = Path(sys.prefix)
        # compiled kernels are killed half-written, too
        own = {"HYBRID_DYNAMICS_CACHE": f"{folder}/kernels", "DVC_SITE_CACHE_DIR": f"{folder}/site"}
        path = f"{venv / 'bin'}{os.pathsep}{os.environ['PATH']}"
        outside = {name: v for name, v in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
        self.environment = {**outside, **own, "PATH": path, "OMP_NUM_THREADS": "1"}
        self.command = ["make", f"--old-file={venv}/ready", f"VENV={venv}", "repro"]
        if target:
            self.command = ["sh", "-c", f"python -m pipeline.mend && dvc --wait-for-lock repro {target}"]

    def start(self) -> subprocess.Popen[bytes]:
        """Begin in a process group of its own; what is said goes to `log`."""
        with (self.folder / "log").open("ab") as log:
            how = {"cwd": self.folder, "env": self.environment, "stdout": log, "stderr": log}
            return subprocess.Popen(self.command, start_new_session=True, **how)  # type: ignore[call-overload]

    def complete(self) -> float:
        """Run to the end and return how long it took, s."""
        begin = time.monotonic()
        self.check(self.start().wait())
        return time.monotonic() - begin

    def kill_after(self, seconds: float) -> bool:
        """Run and kill all processes after a while; whether there was anything left to kill."""
        process = self.start()
        try:
            code = process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return True
        self.check(code, ", it needs help after a kill")
        return False

    def check(self, code: int, why: str = "") -> None:
        """Raise RuntimeError with the end of the log, unless it ended well."""
        if code:
            last = (self.folder / "log").read_text(errors="replace")[-2000:]
            raise RuntimeError(f"exit code {code}{why}:\n{last}")

    def forget(self) -> None:
        """Remove all that the graph made, so that there is something to kill again."""
        for name in ("data", "reports", ".dvc/cache", ".dvc/tmp", "kernels"):
            shutil.rmtree(self.folder / name, ignore_errors=True)
        (self.folder / "dvc.lock").unlink(missing_ok=True)


def killed_again_and_again(project: Project, kills: int, longest: float, seed: int) -> list[str]:
    """Kill `kills` times; what was found half-written, a line each."""
    moments, found, done = random.Random(seed), list[str](), 0
    while done < kills:
        seconds = moments.uniform(SHORTEST, longest)
        if not project.kill_after(seconds):
            print("completed in between, starting over", flush=True)
            project.forget()
            continue
        done += 1
        flaws = half_written(project.folder)
        found += flaws
        count = sum(1 for _ in results(project.folder))
        print(f"kill {done}/{kills} after {seconds:.1f} s: {count} results, {len(flaws)} not whole")
        print("".join(f"  {flaw}\n" for flaw in flaws), end="", flush=True)
    return found


def disturbed(project: Project, seed: int) -> list[str]:
    """Everything else that can happen, on what the last kill left; what went wrong, a line each."""
    found = []
    for disturb in disturbances.ALL:
        name = disturb.__name__.replace("_", " ")
        flaw = disturb(project.command, project.folder, project.environment)
        flaws = [*([f"{name}: {flaw}"] if flaw else []), *half_written(project.folder)]
        print(f"{name}: " + ("\n  ".join(["", *flaws]) if flaws else "as it must be"), flush=True)
        found += flaws
    print(f"damaged {disturbances.damage_cache(project.folder, seed)} files of the cache", flush=True)
    return found


def main() -> int:
    """Do it and say what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=30, help="how often")
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--longest", type=float, default=40.0, help="time until a kill, s")
    parser.add_argument("--target", help="a stage instead of the whole graph")
    parser.add_argument("--folder", type=Path, help="where to work, and what to leave there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        quiet, killed = (Project(folder / name, given.target) for name in ("quiet", "killed"))
        print(f"undisturbed: {quiet.complete():.0f} s", flush=True)
        flaws = killed_again_and_again(killed, given.kills, given.longest, given.seed)
        flaws += disturbed(killed, given.seed)
        print(f"the last run, to its end: {killed.complete():.0f} s", flush=True)
        flaws += half_written(killed.folder)
        compared = metrics(quiet.folder)
        differing = differences(compared, metrics(killed.folder))
    print("\n".join(differing))
    print(f"{given.kills} kills: {len(flaws)} flaws, {len(differing)} of {len(compared)} metrics differ")
    return 1 if flaws or differing or not compared else 0


if __name__ == "__main__":
    sys.exit(main())
