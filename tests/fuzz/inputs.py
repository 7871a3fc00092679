"""Valid inputs, what becomes of them, and what is expected then."""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from unmodelled.base.errors import BadInput

#: Inputs per case, and the seed of the first; `make fuzz` takes more, and others every time.
EXAMPLES, SEED = int(os.environ.get("FUZZ", "25")), int(os.environ.get("FUZZ_SEED", "0"))


class Draw(random.Random):
    """Chooses an input; an error in its block tells how to make the same again."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number

    def __enter__(self) -> Draw:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            error.add_note(f"the same again: FUZZ=1 FUZZ_SEED={self.number}")


def draws(share: float = 1.0) -> list[Draw]:
    """One for every input."""
    return [Draw(number) for number in range(SEED, SEED + max(1, round(share * EXAMPLES)))]


#: What has a meaning somewhere: to CSV, YAML, JSON, zip, Parquet, numbers, or to what reads them.
TOKENS = [
    *(b",", b"\n", b"\r", b'"', b"'", b";", b"\t", b" ", b"\0", b"\xff", b"\xef\xbb\xbf", b"\xc2\x85"),
    *(b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"9" * 400, b"1_0", b"0x1F", b"1e", b"-", b"."),
    *(b"null", b"true", b"{}", b"[]", b"[" * 60, b"{", b"}", b"]", b":", b": ", b"- ", b"#", b"|", b">"),
    *(b"&a ", b"*a", b"<<: *a", b"!!python/object/apply:os.system [ls]", b"!!int ", b"%YAML 1.1\n---\n"),
    *(b"**9**9**9", b"(" * 60, b"__import__('os')", b"lambda: 0", b".__class__", b"exp(", b"diff(", b"/0"),
    *(b"../", b"/etc/passwd", b"PAR1", b"PK\x03\x04", b"${oc.env:HOME}", b"\xf0\x9f\x92\xa5"),
    b"\xe2\x80\xae",
]


def edited(content: bytes, draw: Draw) -> bytes:
    """`content` after a few edits: cut, put, doubled, cut off, in another encoding, or with bits flipped."""
    for _ in range(draw.randint(1, 3)):
        at, length = draw.randint(0, len(content)), draw.randint(1, 40)
        before, after = content[:at], content[at:]
        token = draw.choice(TOKENS) if draw.random() < 0.7 else draw.randbytes(draw.randint(0, 6))
        match draw.choice(["put", "put", "replace", "cut", "double", "truncate", "flip", "encode"]):
            case "put":
                content = before + token + after
            case "replace":
                content = before + token + after[length:]
            case "cut":
                content = before + after[length:]
            case "double":
                content = before + after[:length] + after
            case "truncate":
                content = before
            case "flip":
                content = before + bytes(b ^ (1 << length % 8) for b in after[:1]) + after[1:]
            case "encode":
                encoding = draw.choice(["utf-16", "utf-8-sig", "utf-8", "cp037"])
                content = content.decode("latin-1").encode(encoding)
    return content


@dataclass(frozen=True)
class Case:
    """A folder of valid files and who reads it."""

    files: Mapping[str, bytes]  # by name
    edits: tuple[str, ...]  # names of files that change
    read: Callable[[Path], object]  # raises BadInput, or gives a value
    whole: Callable[[object], None] = lambda _: None  # AssertionError where the value is not as it must be
    share: float = 1.0  # of the inputs that are tried, where reading one takes long

    def put(self, folder: Path, **changed: bytes) -> None:
        """Write the files; keywords are names with __ in place of a dot."""
        for name, content in {**self.files, **{n.replace("__", "."): c for n, c in changed.items()}}.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)

    @classmethod
    def of(cls, folder: Path, edits: tuple[str, ...], read: Callable[[Path], object], **more: Any) -> Case:
        """Of the files in `folder`; no names of files that change: all."""
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
        return cls(files, edits or tuple(files), read, **more)

    @classmethod
    def of_file(cls, name: str, content: bytes, read: Callable[[Path], object], **more: Any) -> Case:
        """Of one file, which `read` reads."""
        return cls({name: content}, (name,), lambda folder: read(folder / name), **more)


def complaint(read: Callable[[Path], object], folder: Path, *names: str) -> str:
    """The one line by which `folder` is refused, which names one of the files; empty if it is read."""
    try:
        read(folder)
    except BadInput as refused:
        for line in (str(refused), *refused.others):
            assert line and line.splitlines() == [line] and line.isprintable(), repr(line)
            assert len(line) < 1000 + 3 * len(str(folder)), line
        line = str(refused)
        assert any(Path(name).name in line for name in names) or str(folder) in line, line
        return line
    return ""
