"""Run `python -m <module> ...` in forks of one process that has loaded the libraries of other projects.

The graph of the tests runs some sixty short commands, and each would spend most of its time on loading torch,
pandas and SymPy. Modules of this program are loaded by every command itself, as always.

    python -m tests.graph.warm <folder>    serve, until the process is ended; <folder>/python is the command
"""

import gc
import importlib
import json
import os
import runpy
import socket
import subprocess
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: Libraries that most commands load, and that take longest to load.
LIBRARIES = (
    *("hydra.utils", "matplotlib.pyplot", "numba", "pandas", "pyarrow.parquet", "scipy.integrate"),
    *("scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.stats", "sympy", "torch"),
)
#: The `python` of a stage: sends its words, folder, environment and open files to the server, and ends with
#: the exit code of the fork.
CLIENT = """#!{python} -IS
import json, os, socket, sys
with socket.socket(socket.AF_UNIX) as server:
    server.connect({address!r})
    words = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(server, [len(words).to_bytes(8)], [0, 1, 2])
    server.sendall(words)
    code = server.recv(1)
sys.exit(code[0] if code else 1)
"""


@contextmanager
def warm_python(folder: Path) -> Iterator[Path]:
    """Yield a new folder with a `python` whose libraries are loaded already."""
    folder.mkdir()
    command = [sys.executable, "-m", "tests.graph.warm", str(folder)]
    root = Path(__file__).parents[2]
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, env=_environment()) as server:
        assert server.stdout is not None and server.stdout.readline() == b"ready\n"
        try:
            yield folder
        finally:
            server.terminate()


def _environment() -> dict[str, str]:
    """Environment in which numerical libraries take one thread, as commands let them."""
    from unmodelled.base.workers import NUMERICAL

    return {**os.environ, **dict.fromkeys(NUMERICAL, "1")}


def serve(folder: Path) -> None:
    """Answer clients in forks, one after the other, as DVC runs its stages."""
    for library in LIBRARIES:
        importlib.import_module(library)
    address = str(folder / "socket")
    client = folder / "python"
    client.write_text(CLIENT.format(python=sys.executable, address=address))
    client.chmod(0o755)
    gc.freeze()
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        listener.listen()
        print("ready", flush=True)
        while True:
            connection, _ = listener.accept()
            if (fork := os.fork()) == 0:
                listener.close()
                os._exit(_answer(connection))
            code = os.waitstatus_to_exitcode(os.waitpid(fork, 0)[1])
            with connection:
                connection.sendall(bytes([code if code >= 0 else 1]))


def _answer(connection: socket.socket) -> int:
    """Run the command of a client in this process; return its exit code."""
    size, files, _, _ = socket.recv_fds(connection, 8, 3)
    with connection.makefile("rb") as stream:
        words, folder, environment = json.loads(stream.read(int.from_bytes(size)))
    for own, file in enumerate(files):
        os.dup2(file, own)
        os.close(file)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    assert words[0] == "-m", words
    sys.path[0], sys.argv = folder, words[1:]
    try:
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return code


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
