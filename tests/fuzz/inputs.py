"""Valid inputs, what becomes of them, and what is expected then."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from pipeline.errors import BadInput

#: Inputs per case; `make fuzz` takes more, and others every time.
EXAMPLES = int(os.environ.get("FUZZ", "25"))

fuzzed = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize="FUZZ" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
)

#: What has a meaning somewhere: to CSV, YAML, JSON, zip, Parquet, numbers, or to what reads them.
TOKENS = [
    *(b",", b"\n", b"\r", b'"', b"'", b";", b"\t", b" ", b"\0", b"\xff", b"\xef\xbb\xbf", b"\xc2\x85"),
    *(b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"9" * 400, b"1_0", b"0x1F", b"1e", b"-", b"."),
    *(b"null", b"true", b"{}", b"[]", b"[" * 60, b"{", b"}", b"]", b":", b": ", b"- ", b"#", b"|", b">"),
    *(b"&a ", b"*a", b"<<: *a", b"!!python/object/apply:os.system [ls]", b"!!int ", b"%YAML 1.1\n---\n"),
    *(b"**9**9**9", b"(" * 60, b"__import__('os')", b"lambda: 0", b".__class__", b"exp(", b"diff(", b"/0"),
    *(
        b"../",
        b"/etc/passwd",
        b"PAR1",
        b"PK\x03\x04",
        b"${oc.env:HOME}",
        b"\xf0\x9f\x92\xa5",
        b"\xe2\x80\xae",
    ),
]


@st.composite
def edited(draw: st.DrawFn, content: bytes) -> bytes:
    """`content` after a few edits: cut, put, doubled, cut off, in another encoding, or with bits flipped."""
    for _ in range(draw(st.integers(1, 3))):
        size = len(content)
        at = draw(st.integers(0, size))
        kind = draw(st.sampled_from(["put", "put", "replace", "cut", "double", "truncate", "flip", "encode"]))
        length = draw(st.integers(1, 40))
        token = draw(st.one_of(st.sampled_from(TOKENS), st.binary(max_size=6)))
        match kind:
            case "put":
                content = content[:at] + token + content[at:]
            case "replace":
                content = content[:at] + token + content[at + length :]
            case "cut":
                content = content[:at] + content[at + length :]
            case "double":
                content = content[:at] + content[at : at + length] + content[at:]
            case "truncate":
                content = content[:at]
            case "flip" if at < size:
                content = content[:at] + bytes([content[at] ^ (1 << length % 8)]) + content[at + 1 :]
            case "encode":
                text = content.decode("latin-1")
                content = text.encode(draw(st.sampled_from(["utf-16", "utf-8-sig", "utf-8", "cp037"])))
    return content


@dataclass(frozen=True)
class Case:
    """A folder of valid files and who reads it.

    Attributes:
        files: name -> content. edits: names of those that change. read: raises BadInput, or gives a value.
        whole: whether the value is as it must be, else an AssertionError.
    """

    files: Mapping[str, bytes]
    edits: tuple[str, ...]
    read: Callable[[Path], object]
    whole: Callable[[object], None] = lambda _: None

    def put(self, folder: Path, **changed: bytes) -> None:
        """Write the files; keywords are names with __ in place of a dot."""
        for name, content in {**self.files, **{n.replace("__", "."): c for n, c in changed.items()}}.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)

    @classmethod
    def of(cls, folder: Path, edits: tuple[str, ...], read: Callable[[Path], object]) -> Case:
        """Of the files in `folder`."""
        files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        return cls(files, edits, read)


def complaint(read: Callable[[Path], object], folder: Path, *names: str) -> str:
    """The one line by which `folder` is refused, which names one of the files; empty if it is read."""
    try:
        read(folder)
    except BadInput as refused:
        line = str(refused)
        assert line and line.splitlines() == [line] and line.isprintable(), repr(line)
        assert len(line) < 1000 + 3 * len(str(folder)), line
        assert any(Path(name).name in line for name in names) or str(folder) in line, line
        return line
    return ""
