"""Read all robot files of a folder, and write a table of what was said of each.

    python -m docs.own_data.robot_files FOLDER docs/own_data/robot_files.tsv

FOLDER holds URDF (*.urdf) and MJCF files (*.xml), also deeper down, such as an unpacked package. Every file
is read in a process of its own, with all its joints, as the model of a system file that says nothing else.
"""

from __future__ import annotations

import multiprocessing
import sys
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from shutil import copyfile

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.systems.reader import read_system

#: Longest time that one file may take, s.
LONGEST = 1200.0
COLUMNS = ("file", "read", "joints", "CPU seconds", "notes or refusal")


def row(file: Path, name: str) -> tuple[str, ...]:
    """Return what is said of a robot file."""
    mine, other = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=_read, args=(file, other))
    process.start()
    other.close()
    try:
        said = mine.recv() if mine.poll(LONGEST) else ("no", "", "", f"takes more than {LONGEST:.0f} s")
    except EOFError:
        said = ("no", "", "", "the process ended without a word")
    process.kill()
    process.join()
    return (name, *said)


def _read(file: Path, connection: Connection) -> None:
    with tempfile.TemporaryDirectory() as folder:
        copyfile(file, Path(folder, file.name))
        system = Path(folder, "system.yaml")
        system.write_text(f"schema: system/1\nname: robot\nmodel: {file.name}\n", encoding="utf-8")
        start = time.process_time()
        try:
            found = read_system(system)
            said = "yes", str(len(found.ports)), "; ".join(found.notes)
        except BadInput as error:
            said = "no", "", str(error).replace(f"{folder}/", "")
        taken = f"{time.process_time() - start:.1f}"
    connection.send((*said[:2], taken, said[2].replace(f"{file.name}: ", "")))


def main(folder: Path, out: Path) -> None:
    """Write the table, tab-separated, of the robot files of a folder."""
    files = sorted(file for kind in ("*.urdf", "*.xml") for file in folder.rglob(kind) if _is_robot(file))
    rows = []
    for file in files:
        rows.append(row(file, file.relative_to(folder).as_posix()))
        print(*rows[-1], sep="\t", flush=True)
    with replacing(out) as temporary:
        temporary.write_text("".join("\t".join(each) + "\n" for each in (COLUMNS, *rows)), encoding="utf-8")
    for kind in ("urdf", "xml"):
        own = [each for each in rows if each[0].endswith(f".{kind}")]
        print(f"{kind}: {sum(each[1] == 'yes' for each in own)} of {len(own)} read")


def _is_robot(file: Path) -> bool:
    text = file.read_text(encoding="utf-8", errors="replace")
    return "<robot" in text or "<mujoco" in text


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
