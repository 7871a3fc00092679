"""Logs in HDF5 files: a group (or the file itself) is an experiment, a dataset is a column.

A damaged file can crash the HDF5 library or keep it busy for ever: a separate process with limits on memory
and time reads it. Nothing outside the file is followed: links, external data and plug-ins are refused.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, Faults, first_line
from unmodelled.base.files import replacing
from unmodelled.base.limits import check_memory, limit_time, limited_process
from unmodelled.base.shapes import ORIGIN, check_shape
from unmodelled.base.workers import pool_of
from unmodelled.logs.cells import check_finite
from unmodelled.logs.recognition import refuse_missing
from unmodelled.logs.table import Columns, TextTable
from unmodelled.systems.units import parse_unit

if TYPE_CHECKING:
    import h5py  # loaded by those who read or write such a file alone


#: Processor time that reading a log may take: seconds for any of them, bytes of numbers per further second.
SECONDS, RATE = 5.0, 1e7
#: Filters that need no plug-in: gzip, shuffle, Fletcher32, szip and n-bit of the HDF5 library, lzf of h5py.
FILTERS = (1, 2, 3, 4, 5, 32000)
#: Root attribute with the provenance of a campaign, as JSON text.
PROVENANCE = "provenance"


@dataclass(frozen=True)
class Address:
    """Place of an experiment."""

    file: Path
    group: str = ""  # path in an HDF5 file; "": the file itself

    @property
    def path(self) -> Path:
        """The place as error messages show it: `campaign.h5:/run1`."""
        return Path(f"{self.file}:/{self.group}") if self.group else self.file


def read_hdf5(places: Sequence[Address], units: Mapping[str, str], faults: Faults) -> dict[Address, Columns]:
    """Read columns of logs."""
    found: dict[Address, Columns] = {}
    if not places:
        return found
    with pool_of(1) as pool:
        futures = [pool.submit(_limited, _columns, place, place, dict(units)) for place in places]
        for place, future in zip(places, futures, strict=True):
            with faults.collected():
                found[place] = Columns(place.path, _result(future, place), header=False)
            if isinstance(future.exception(), BrokenProcessPool):
                break  # the one that broke it is named; the others were not read
    return found


def read_campaign(path: Path, constants: Sequence[str]) -> tuple[TextTable, dict[str, Any]]:
    """Read the experiments in the groups of an HDF5 file as a table of text like experiments.csv."""
    place = Address(path)
    with pool_of(1) as pool:
        groups, provenance = _result(pool.submit(_limited, _groups, place, place), place)
    faults = Faults()
    for name, attributes in groups.items():
        for constant in (constant for constant in constants if constant not in attributes):
            faults.add(f"{Address(path, name).path}: attribute {constant} is missing: write it as a number")
    faults.check()
    if not groups:
        raise BadInput(f"{path}: holds no groups: put the datasets of every experiment in a group of its own")
    names = list(dict.fromkeys(key for attributes in groups.values() for key in attributes))
    rows = [
        (row, [name, f"{path.name}:/{name}", *(attributes.get(key, "") for key in names)])
        for row, (name, attributes) in enumerate(groups.items(), start=1)
    ]
    return TextTable(path, ["id", "file", *names], rows), _origin(path, provenance)


def write_hdf5(
    path: Path,
    experiments: pd.DataFrame,
    samples: Sequence[Mapping[str, Array]],
    units: Mapping[str, str],
    provenance: Mapping[str, Any],
) -> None:
    """Write a campaign of samples (samples,) as one HDF5 file, which `read_logs` takes like a folder."""
    import h5py

    described = experiments.drop(columns="file", errors="ignore").to_dict("records")
    for row in described:
        if row["id"] == "." or "/" in row["id"]:
            raise BadInput(f"{path}: the experiment {row['id']!r} cannot be a group: rename it, without '/'")
    with (
        replacing(path) as temporary,
        h5py.File(temporary, "w", libver=("v108", "v110"), track_order=True) as file,
    ):
        file.attrs[PROVENANCE] = json.dumps(dict(provenance))
        for row, log in zip(described, samples, strict=True):
            group = file.create_group(row.pop("id"))
            group.attrs.update({name: value for name, value in row.items() if pd.notna(value)})
            for name, values in log.items():
                dataset = group.create_dataset(
                    name, data=values, compression="gzip", shuffle=True, fletcher32=True
                )
                if name in units:
                    dataset.attrs["unit"] = units[name]


def _result(future: Future[Any], place: Address) -> Any:
    try:
        return future.result()
    except BrokenProcessPool:
        raise BadInput(f"{place.path}: damaged: the HDF5 library crashes on it, or does not end") from None


def _origin(path: Path, provenance: str | None) -> dict[str, Any]:
    if provenance is None:
        return {"data": "measured", "description": f"HDF5 file {path.resolve().name}"}
    try:
        content: dict[str, Any] = json.loads(provenance)
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: attribute {PROVENANCE}: is not JSON ({error})") from None
    check_shape(path, content, ORIGIN)
    return content


def _limited(function: Callable[..., Any], place: Address, *args: Any) -> Any:
    """Call `function` in the process that reads, within its limits; refuse what the library cannot read."""
    try:
        with limited_process(SECONDS):
            return function(*args)
    except BadInput:
        raise
    except Exception as error:  # there is no common base of what a damaged file can raise
        reason = first_line(error)
        raise BadInput(f"{place.path}: not an HDF5 file, or damaged ({reason[:100]})") from None


def _columns(place: Address, units: Mapping[str, str]) -> dict[str, Array]:
    """The wanted datasets of an experiment, (n,) each."""
    import h5py

    with h5py.File(place.file, "r") as file:
        group: Any = file
        for name in filter(None, place.group.split("/")):
            group = _member(group, name, place.path)
        if not isinstance(group, h5py.Group):
            raise BadInput(f"{place.path}: is a dataset, not a group of datasets")
        refuse_missing(str(place.path), "the group", list(group), list(units))
        datasets = {name: _member(group, name, place.path) for name in units}
        faults = Faults()
        for name, dataset in datasets.items():
            with faults.collected():
                _check_dataset(place.path, name, dataset, units[name])
        faults.check()
        size = 8.0 * sum(dataset.size for dataset in datasets.values())
        check_memory(f"{place.path} ({datasets['t'].size} samples)", size)
        limit_time(SECONDS + size / RATE)
        values = {name: np.ravel(dataset[...]).astype(np.float64) for name, dataset in datasets.items()}
    for name, column in values.items():
        with faults.collected():
            if len(column) != len(values["t"]):
                wanted = f"must have {len(values['t'])} samples like t, got {len(column)}"
                raise BadInput(f"{place.path}: column {name}: {wanted}")
            check_finite(place.path, name, column)
    faults.check()
    return values


def _member(group: Any, name: str, place: Path) -> Any:
    """Return the member of a group with a given name, if it lies in the group itself."""
    import h5py

    link = group.get(name, getlink=True) if isinstance(group, h5py.Group) else None
    if link is None:
        raise BadInput(f"{place}: no such group")
    if not isinstance(link, h5py.HardLink):
        raise BadInput(f"{place}: {name[:30]!r} is a link to another place: store a copy of the data instead")
    return group[name]


def _check_dataset(place: Path, name: str, dataset: h5py.Dataset, unit: str) -> None:
    import h5py

    where = f"{place}: column {name}"
    if not isinstance(dataset, h5py.Dataset):
        raise BadInput(f"{where}: is a group, not a dataset")
    if dataset.dtype.kind not in "fiu" or max(dataset.shape or (0,)) != math.prod(dataset.shape or (1,)):
        found = f"shape {dataset.shape} of {dataset.dtype}"[:80]
        raise BadInput(f"{where}: must be a column of numbers, got {found}")
    if dataset.is_virtual or dataset.external:
        raise BadInput(f"{where}: its data lie in another file: store a copy of the data instead")
    if needs_plugin(dataset):
        raise BadInput(f"{where}: needs a plug-in to be unpacked: compress it with gzip")
    for own in (_text(dataset.attrs[key]) for key in ("unit", "units") if key in dataset.attrs):
        if own is not None and own.strip() != unit.strip():
            _check_unit(where, own, unit)


def needs_plugin(dataset: h5py.Dataset) -> bool:
    """Return whether a dataset is packed by a filter of others."""
    plan = dataset.id.get_create_plist()
    return any(plan.get_filter(k)[0] not in FILTERS for k in range(plan.get_nfilters()))


def _check_unit(where: str, found: str, unit: str) -> None:
    try:
        same = parse_unit(found).dimension == parse_unit(unit).dimension
    except ValueError as error:
        raise BadInput(
            f"{where}: attribute unit: {error}: convert the values, or correct the attribute"
        ) from None
    if not same:
        raise BadInput(
            f"{where}: attribute unit: {found[:30]!r}, the system file has {unit!r}: correct one of them"
        )


def _groups(place: Address) -> tuple[dict[str, dict[str, str]], str | None]:
    """Return the attributes of every group as text, and the text of the provenance."""
    import h5py

    with h5py.File(place.file, "r") as file:
        if "t" in file:
            name = place.file.name
            raise BadInput(
                f"{place.file}: is one experiment: name it in the column file of experiments.csv ({name})"
            )
        groups: dict[str, dict[str, str]] = {}
        for name in file:
            group = _member(file, name, place.file)
            if isinstance(group, h5py.Group):
                texts = {key: _text(value) for key, value in group.attrs.items()}
                groups[name] = {key: text for key, text in texts.items() if text is not None}
        return groups, _text(file.attrs[PROVENANCE]) if PROVENANCE in file.attrs else None


def _text(value: Any) -> str | None:
    """A number or text as the text of a cell; None for arrays and what else an attribute can be."""
    found = value.item() if isinstance(value, np.generic | np.ndarray) and value.size == 1 else value
    if isinstance(found, bytes):
        return found.decode("utf-8", "replace")
    return str(found) if isinstance(found, str | int | float) else None
