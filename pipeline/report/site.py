"""Reads what the other stages wrote and writes the site: index.html, all else in the folder site."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.errors import BadInput
from pipeline.files import read_json, replacing, replacing_folder
from pipeline.report.equations import read_equations
from pipeline.report.pages import Contents, Figure, Page, Results, contents, pages
from pipeline.report.tables import VERDICTS, Table, file_table, leaves, number, runs_table

HERE = Path(__file__).parent

ORIGINS = {
    "virtual": "Virtual campaign – simulated logs, not measurements",
    "measured": "Measured data",
    "": "No campaign yet – nothing was run",
}

CLAIM = (
    "id",
    "chapter",
    "page",
    "claim",
    "dissertation",
    "ours",
    "interval",
    "unit",
    "protocol",
    "data",
    "verdict",
)


def read(metrics: Path, claims: Path, tables: Path, figures: Path, provenance: Path, runs: Path) -> Results:
    """Read every input that exists.

    Raises:
        BadInput: names the file that cannot be used.
    """
    return Results(
        _claims(claims),
        read_figures(figures) if (figures / "figures.json").exists() else [],
        [_table(path) for path in sorted(tables.glob("*.csv"))],
        {path.stem: _metrics(path) for path in sorted(metrics.glob("*.json"))},
        {
            path.parent.relative_to(provenance).as_posix(): _provenance(path)
            for depth in ("*", "*/*")
            for path in sorted(provenance.glob(f"{depth}/provenance.json"))
        },
        {
            path.parent.relative_to(runs).as_posix(): _object(path)
            for path in sorted(runs.glob("**/fit.json"))
        },
        [read_equations(path) for path in sorted(claims.glob("*/equations.json"))],
    )


def build(results: Results, out: Path) -> None:
    """Write the site; equal results give equal bytes.

    Raises:
        BadInput: when the folder cannot be written; the old site stays.
    """
    every = pages(results)
    shown = {page.id: contents(page, results) for page in every}
    html = {page.file: _render(page, every, shown, results) for page in every}
    tables = [runs_table(results.runs), *results.tables]
    tables += [table for c in shown.values() for table in (c.claims, *c.metrics) if table.rows]
    with replacing_folder(out / "site") as site, replacing(out / "index.html") as index:
        for file, text in html.items():
            (index if file.startswith("..") else site / file).write_text(text)
        (site / "tables").mkdir()
        for table in tables:
            (site / "tables" / f"{table.id}.csv").write_text(table.csv)
        (site / "figures").mkdir()
        for figure in results.figures:
            shutil.copyfile(figure.source, site / "figures" / figure.source.name)
        for asset in sorted((HERE / "static").iterdir()):
            shutil.copyfile(asset, site / asset.name)
        (site / "search.js").write_text(f"window.SEARCH = {json.dumps(_index(every, shown), indent=0)};\n")


def templates() -> Environment:
    """The templates of all pages."""
    return Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def _render(page: Page, every: list[Page], shown: dict[str, Contents], results: Results) -> str:
    root = "site/" if page.id == "index" else ""

    def address(file: str) -> str:
        # from the home page the way into the site folder and out again would be the long one
        return file.removeprefix("../") if root and file.startswith("../") else root + file

    campaign = results.campaign(page)
    origin = campaign.get("data", "")
    return (
        templates()
        .get_template(page.template)
        .render(
            page=page,
            pages=every,
            shown=shown,
            here=shown[page.id],
            results=results,
            campaign=campaign,
            runs=runs_table(results.runs),
            root=root,
            address=address,
            origin=origin,
            banner=ORIGINS[origin],
            mixed=sorted(shown[page.id].origins - {origin}),
            verdicts=VERDICTS,
            number=number,
        )
    )


def _index(every: list[Page], shown: dict[str, Contents]) -> list[dict[str, str]]:
    """What the search box looks through; addresses are seen from the site folder."""
    found = [{"kind": "page", "title": page.title, "text": page.summary, "url": page.file} for page in every]
    for page in every[1:]:
        here = shown[page.id]
        for f in here.figures:
            title = f"Figure {f.number}"
            found.append({"kind": "figure", "title": title, "text": f.caption, "url": f"{page.file}#{f.id}"})
        for row, anchor in zip(here.claims.rows, here.claims.anchors, strict=True):
            verdict = row[3].text
            found.append(
                {"kind": "claim", "title": row[0].text, "text": verdict, "url": f"{page.file}#{anchor}"}
            )
        for t in here.tables:
            found.append({"kind": "table", "title": t.title, "text": t.caption, "url": f"{page.file}#{t.id}"})
        for t in here.metrics:
            names = " ".join(row[0].text for row in t.rows)
            found.append({"kind": "metrics", "title": t.title, "text": names, "url": f"{page.file}#{t.id}"})
    return found


def _object(path: Path) -> dict[str, Any]:
    content = read_json(path)
    if not isinstance(content, dict):
        raise BadInput(f"{path}: must be an object")
    return content


def _rows(path: Path, keys: tuple[str, ...]) -> list[dict[str, Any]]:
    content = read_json(path)
    if not isinstance(content, list) or not all(isinstance(row, dict) for row in content):
        raise BadInput(f"{path}: must be a list of objects")
    for i, row in enumerate(content, 1):
        missing = [key for key in keys if key not in row]
        if missing:
            raise BadInput(f"{path}: row {i} has no {', '.join(missing)}")
    return content


def _choice(path: Path, where: str, value: Any, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise BadInput(f"{path}: {where} {value!r}, must be one of {', '.join(allowed)}")


def _chapter(path: Path, where: str, value: Any, *, needed: bool = False) -> None:
    if (value is None and needed) or not isinstance(value, int | None):
        raise BadInput(f"{path}: {where} chapter {value!r}, must be a whole number")


def _interval(path: Path, where: str, value: Any) -> None:
    if value is None:
        return
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(v, int | float) for v in value):
        raise BadInput(f"{path}: {where} interval {value!r}, must be two numbers")


def _claims(folder: Path) -> list[dict[str, Any]]:
    found = []
    for path in sorted(folder.glob("*/claims.json")):
        rows = _rows(path, CLAIM)
        for row in rows:
            where = f"claim {row['id']!r}:"
            _choice(path, f"{where} verdict", row["verdict"], tuple(VERDICTS))
            _choice(path, f"{where} data", row["data"], ("measured", "virtual"))
            _chapter(path, where, row["chapter"], needed=True)
            _interval(path, where, row["interval"])
        found += rows
    return sorted(found, key=lambda row: row["chapter"])


def read_figures(folder: Path) -> list[Figure]:
    """What `folder`/figures.json lists, by chapter and number.

    Raises:
        BadInput: when it is damaged, or names a file that does not exist.
    """
    path = folder / "figures.json"
    found = []
    for row in _rows(path, ("id", "number", "chapter", "caption")):
        if not re.fullmatch(r"\w+", str(row["id"])):
            raise BadInput(f"{path}: id {row['id']!r}, must be letters, digits and underscores")
        source = folder / f"{row['id']}.svg"
        if not source.exists():
            raise BadInput(f"{source}: no such file, but {path} lists it")
        _chapter(path, f"figure {row['id']!r}:", row["chapter"])
        caption, note, command, data = (
            str(row.get(key) or "") for key in ("caption", "note", "command", "data")
        )
        found.append(
            Figure(
                row["id"],
                str(row["number"]),
                row["chapter"],
                caption,
                note,
                command,
                data,
                source,
                _size(source),
            )
        )
    return sorted(found, key=lambda f: (f.chapter or 0, [int(n) for n in re.findall(r"\d+", f.number)], f.id))


def _size(path: Path) -> tuple[int, int] | None:
    """Width and height, so that a page does not move while its figures load."""
    box = re.search(rb'<svg[^>]*viewBox="[\d.-]+ [\d.-]+ ([\d.]+) ([\d.]+)"', path.read_bytes()[:4000])
    # figures are drawn in points, 72 to the inch; a browser has 96 pixels there
    return (round(float(box[1]) * 96 / 72), round(float(box[2]) * 96 / 72)) if box else None


def _table(path: Path) -> Table:
    sidecar = path.with_suffix(".json")
    about = _object(sidecar) if sidecar.exists() else {}
    if not re.fullmatch(r"\w+", path.stem):
        raise BadInput(f"{path}: the name must be letters, digits and underscores")
    _chapter(sidecar, "", about.get("chapter"))
    try:
        return file_table(path.stem, path.read_text(), about)
    except (ValueError, IndexError) as error:
        raise BadInput(f"{path}: not a table with a header and equally long rows ({error})") from None


def _metrics(path: Path) -> dict[str, Any]:
    content = _object(path)
    _choice(path, "data", content.get("data"), ("measured", "virtual"))
    _chapter(path, "", content.get("chapter"))
    for name, leaf, _ in leaves(content, ""):
        _interval(path, ".".join(name), leaf.get("interval"))
    return content


def _provenance(path: Path) -> dict[str, Any]:
    content = _object(path)
    _choice(path, "data", content.get("data"), ("measured", "virtual"))
    return content
