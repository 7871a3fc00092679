"""Stages that start at once: `python -m pipeline.preloaded <command>`, such as `dvc repro`.

Most of a short stage is the time that its libraries take to load. While the command runs, this process, which
has them loaded, forks for every `python -m pipeline` below the command. A fork is a stage as any other, with
the terminal, folder and environment of who asked for it. Where it cannot be the same stage, as after an edit
of the program, who asked runs it itself.
"""

from __future__ import annotations

import atexit
import gc
import hashlib
import json
import multiprocessing
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, NoReturn

import psutil

import unmodelled
from unmodelled.base.workers import INTERRUPTED, end_with_parent, heed_interruptions, leave

#: Environment variable with the path of the socket.
ADDRESS = "EXP_PRELOADED"
#: What libraries read once, when they are loaded, starts with one of these.
READ_ONCE = ("PYTHON", "NUMBA_", "OMP_", "OPENBLAS_", "MKL_", "KMP_", "MPL", "TORCH", "LD_")
ACCEPTED = b"+"
#: First letters of the folder of the socket.
FOLDER = "exp-preloaded-"
PACKAGE = Path(__file__).parent
#: Where the program is: here, and the library.
PROGRAM = (PACKAGE, Path(unmodelled.__file__).parent)


class Request(NamedTuple):
    """What a stage is run with."""

    arguments: list[str]
    folder: str
    environment: dict[str, str]
    program: str


class Asked(NamedTuple):
    """A request, standard input, output and error of who asks, and the connection to it."""

    request: Request
    terminal: list[int]
    connection: socket.socket

    def accepted(self) -> bool:
        """Say that a fork will do it; False when who asked is gone."""
        try:
            self.connection.sendall(ACCEPTED)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Leave it to the fork, or to who asks."""
        self.connection.close()
        for descriptor in self.terminal:
            os.close(descriptor)


def ask(arguments: list[str]) -> int | None:
    """The exit code of a stage that a fork has run; None where the caller must run it."""
    request = Request(arguments, str(Path.cwd()), dict(os.environ), _program())
    with socket.socket(socket.AF_UNIX) as connection:
        try:
            connection.connect(os.environ[ADDRESS])
            socket.send_fds(connection, [b"?"], [0, 1, 2])
            connection.sendall(json.dumps(request).encode() + b"\n")
            if connection.recv(1) != ACCEPTED:
                return None
        except OSError:
            return None
        # the terminal interrupts the fork as well, which says so
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        code = b""
        # until nobody holds the other end any more: the fork has come to its end
        while received := connection.recv(1):
            code = received
    if not code:
        print("error: the stage was killed", file=sys.stderr)
    return code[0] if code else 1


def serve(command: list[str]) -> int:
    """Run `command`, and the stages below it in forks of this process.

    Returns:
        The exit code of the command; in a fork, that of its stage. As `os.fork`, it returns in both.
    """
    _remove_left()
    folder = Path(tempfile.mkdtemp(prefix=FOLDER))  # for this user only
    address, owner = str(folder / "socket"), os.getpid()
    atexit.register(_end, owner)
    listener = socket.socket(socket.AF_UNIX)
    try:
        listener.bind(address)
    except OSError:  # the path is too long for a socket: every stage runs by itself
        shutil.rmtree(folder)
        return _as_shell(subprocess.call(command))
    listener.listen()
    # an interruption is for the command and the stages, which come to an end by it
    signal.signal(signal.SIGINT, lambda *_: None)
    signal.signal(signal.SIGTERM, partial(_end_all, folder))
    ending = partial(end_with_parent, signal.SIGTERM)
    process = subprocess.Popen(command, env={**os.environ, ADDRESS: address}, preexec_fn=ending)
    try:
        forked = _forks(listener, process)
    finally:
        listener.close()  # who asks from now on runs it itself
        if os.getpid() == owner:
            code = process.wait()
            shutil.rmtree(folder)
    if forked is not None:
        _stage(*forked)
    return _as_shell(code)


def _end_all(folder: Path, number: int, _: object) -> NoReturn:
    """Kill the command, the stages, and all that they started, and be gone as if by the signal `number`."""
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            process.kill()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(128 + number)


def _remove_left() -> None:
    """Remove the folders of servers that were killed: nobody answers at their sockets."""
    for folder in Path(tempfile.gettempdir()).glob(f"{FOLDER}*"):
        with suppress(OSError), socket.socket(socket.AF_UNIX) as connection:
            if folder.lstat().st_uid == os.getuid():
                try:
                    connection.connect(str(folder / "socket"))
                except ConnectionRefusedError:
                    shutil.rmtree(folder)


def _as_shell(code: int) -> int:
    """What a shell makes of the exit code of a process: 128 and the number of the signal that killed it."""
    return code if code >= 0 else 128 - code


def _forks(listener: socket.socket, process: subprocess.Popen[bytes]) -> Asked | None:
    """In every fork what it is asked for; None when the command has ended."""
    program, environment = _program(), _read_once(os.environ)
    _load()
    forks: set[int] = set()
    while process.poll() is None:
        forks -= {pid for pid in forks if os.waitpid(pid, os.WNOHANG)[0]}
        if not select.select([listener], [], [], 0.1)[0]:
            continue
        asked = _received(listener.accept()[0])
        if asked is None:
            continue
        request = asked.request
        same = request.program == program and _read_once(request.environment) == environment
        if same and asked.accepted():
            pid = os.fork()
            if pid == 0:
                signal.signal(signal.SIGTERM, signal.SIG_DFL)
                end_with_parent(signal.SIGKILL)
                return asked
            forks.add(pid)
        asked.close()
    return None


def _load() -> None:
    """Load what stages load."""
    for stage in sorted((PACKAGE / "stages").glob("[a-z]*.py")):
        import_module(f"pipeline.stages.{stage.stem}")
    import_module("hydra.main")
    # what these make of themselves when they are first used
    import_module("unmodelled.systems.units").parse_unit("N s/m")
    import_module("numba").njit(lambda: 0)()
    gc.collect()
    gc.freeze()  # a fork that looks for garbage would copy the memory that it shares


def _received(connection: socket.socket) -> Asked | None:
    connection.settimeout(5.0)
    try:
        terminal = socket.recv_fds(connection, 1, 3)[1]
        text = b""
        while not text.endswith(b"\n") and (part := connection.recv(2**16)):
            text += part
        request = Request(*json.loads(text))
    except (OSError, ValueError, TypeError):
        connection.close()  # who asks has been killed
        return None
    connection.settimeout(None)
    return Asked(request, list(terminal), connection)


def _read_once(environment: Mapping[str, str]) -> dict[str, str]:
    return {name: text for name, text in environment.items() if name.startswith(READ_ONCE)}


def _program() -> str:
    """Digest of the interpreter and of the program on disk: path, time and size of every file."""
    digest = hashlib.sha256(f"{sys.executable} {sys.flags} {PACKAGE}".encode())
    for file in sorted(file for package in PROGRAM for file in package.rglob("*.py")):
        stat = file.stat()
        digest.update(f"{file} {stat.st_mtime_ns} {stat.st_size}".encode())
    return digest.hexdigest()


def _stage(request: Request, terminal: list[int], connection: socket.socket) -> NoReturn:
    """Be the stage: its exit code goes to who asked, the end of this process says that it is over."""
    from pipeline.__main__ import main
    from unmodelled.base.workers import NUMERICAL

    heed_interruptions()
    for standard, descriptor in enumerate(terminal):
        os.dup2(descriptor, standard)
        os.close(descriptor)
    sys.stdout.reconfigure(line_buffering=os.isatty(1))  # type: ignore[union-attr]
    os.chdir(request.folder)
    os.environ.clear()
    os.environ.update(request.environment)
    # its workers are forks as well, where no library has threads that they would miss
    if all(os.environ.get(library) == "1" for library in NUMERICAL):
        multiprocessing.set_start_method("fork")
    sys.argv = [str(PACKAGE / "__main__.py"), *request.arguments]
    sys.path[0] = request.folder
    threading.Thread(target=_end_with, args=(connection,), daemon=True).start()
    code: object = 1
    try:
        code = main(request.arguments)
    except SystemExit as end:
        code = end.code
    finally:
        sys.stdout.flush()
        connection.sendall(bytes([code if isinstance(code, int) else code is not None]))
    leave(INTERRUPTED if code == INTERRUPTED else 0)


def _end(owner: int) -> None:
    """The last thing that a fork does, for Python would copy all the memory that it shares to tidy it."""
    if os.getpid() != owner:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


def _end_with(connection: socket.socket) -> None:
    """A stage whose caller was killed is killed as well."""
    if not connection.recv(1):
        os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    from unmodelled.base.workers import limit_threads

    if len(sys.argv) < 2:
        sys.exit("usage: python -m pipeline.preloaded <command>, such as dvc repro")
    limit_threads()
    sys.exit(serve(sys.argv[1:]))
