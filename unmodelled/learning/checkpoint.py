"""Write and read the weights of fitted models; nothing in a file is executed."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import torch
from torch import nn

from unmodelled.base.errors import BadInput, first_line
from unmodelled.base.files import replacing
from unmodelled.base.limits import check_file, check_memory


def save(model: nn.Module, path: Path, about: dict[str, Any]) -> None:
    """Write the weights of fitted models."""
    write_checkpoint(path, {"class": type(model).__name__, "state": model.state_dict(), "about": about})


def write_checkpoint(path: Path, content: dict[str, Any]) -> None:
    """Write a checkpoint of any content."""
    whole = io.BytesIO()  # torch itself does not say of a full disk that it is full
    torch.save(content, whole)
    with replacing(path) as temporary:
        temporary.write_bytes(whole.getbuffer())


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read a checkpoint; nothing in the file is executed."""
    check_file(path)
    try:
        _check_memory(path)
        _check_sums(path)
        content = torch.load(path, weights_only=True)
        return {key: content[key] for key in ("class", "state", "about")}
    except BadInput:
        raise
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except Exception as error:  # torch has no common base for what a damaged file can raise
        reason = first_line(error)
        raise BadInput(f"{path}: not a checkpoint ({reason[:80]})") from None


def _check_memory(path: Path) -> None:
    """Refuse what grows when it is unpacked, and tensors that are larger than what is kept of them."""
    with zipfile.ZipFile(path) as archive:
        check_memory(path, sum(member.file_size for member in archive.infolist()))
    content = torch.load(path, weights_only=True, map_location="meta")  # sizes alone
    if isinstance(state := content["state"], dict):
        tensors = [value for value in state.values() if isinstance(value, torch.Tensor)]
        check_memory(path, sum(tensor.numel() * tensor.element_size() for tensor in tensors))


def _check_sums(path: Path) -> None:
    """Torch itself reads a file in which bits have changed, with other weights."""
    with zipfile.ZipFile(path) as archive:
        if damaged := archive.testzip():
            raise zipfile.BadZipFile(f"{damaged} is damaged")


def restore(model: nn.Module, content: dict[str, Any], path: Path) -> None:
    """Put the weights of a checkpoint into a module."""
    if content["class"] != type(model).__name__:
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, another model than the configured one"
        )
    try:
        model.load_state_dict(content["state"])
    except (RuntimeError, AttributeError, TypeError) as error:
        reason = str(error).splitlines()[-1].strip()
        raise BadInput(f"{path}: does not fit the configured model ({reason[:120]})") from None
