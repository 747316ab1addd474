"""A report as one HTML page that needs no other file, no network and no script."""

from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.errors import DamagedFile, PbcsError
from pbcs_ompl.core.formatting import format_number, format_value
from pbcs_ompl.core.utf8 import utf8
from pbcs_ompl.results.files import check_replaceable, write_atomically, write_errors
from pbcs_ompl.results.folder import find_folders
from pbcs_ompl.results.report.section import DAMAGED, Section, damaged_section, make_section

REPORT = "report.html"
GENERATOR = '<meta name="generator" content="pbcs report">'
"""Marks a page of ours, which a new one may replace."""


class Report(NamedTuple):
    """A report that was written.

    Attributes:
        page: The file.
        sections: What it shows of each folder.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.plan("pbcs/Maze-v0", seed=0, out="runs/plan")
        >>> [one["kind"] for one in pbcs_ompl.write_report("runs").summary()["folders"]]
        ['plan']
    """

    page: Path
    sections: list[Section]

    def summary(self) -> dict[str, Any]:
        """Return plain values: `out`, `folders` with their kinds and outcomes, the reasons of `damaged` ones."""
        folders = [{"folder": section.name, "kind": section.kind, "outcome": section.content.outcome}
                   for section in self.sections]
        damaged = {section.name: reason for section in self.sections if section.kind == DAMAGED
                   for _, reason in section.content.failures}
        return {"out": str(self.page), "folders": folders, "damaged": damaged}


@checked
def write_report(folder: str | Path, out: str | Path | None = None) -> Report:
    """Write what a result folder holds, or all result folders below one, as one HTML page.

    Args:
        folder: A result folder, or one that holds many.
        out: The page; report.html in `folder` by default. A report that is there already is replaced.

    Nothing that a folder names is imported, and no link out of a folder is followed.

    Raises:
        RunFolderError: no results in `folder`; or `out` is not a report, or cannot be written.
        DamagedFile: `folder` is a result folder with a damaged file. One among many is reported on the page.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.plan("pbcs/Maze-v0", seed=0, out="runs/plan")
        >>> pbcs_ompl.write_report("runs").page.name
        'report.html'
    """
    root = Path(folder)
    paths = find_folders(root)
    page, single = root / REPORT if out is None else Path(out), paths == [root]
    with write_errors(page):
        check_replaceable(page, GENERATOR, "pbcs report")
    templates = _templates()
    shown = [_shown(path, root, page, number, templates, single) for number, path in enumerate(paths, start=1)]
    sections = [section for section, _ in shown]
    stream = templates.get_template("report.html").generate(
        sections=sections, texts=[text for _, text in shown], single=single, root=str(root), generator=GENERATOR,
        version=version("pbcs-ompl"), now=datetime.now().astimezone().isoformat(sep=" ", timespec="minutes"))
    write_atomically(page, lambda file: file.writelines(utf8(part) for part in stream))
    return Report(page, sections)


def _shown(path: Path, root: Path, page: Path, number: int, templates: Environment,
           single: bool) -> tuple[Section, str]:
    """Return the section of a folder, and its text; whatever is wrong with one of many costs only its own section.

    Args:
        path: The folder.
        root: That of the report.
        page: The report.
        number: Its place on the page, from 1.
        templates: Ours.
        single: Whether it is the only folder.

    Raises:
        DamagedFile: it is the only folder, and cannot be shown.
    """
    text = templates.get_template("section.html").module.section  # type: ignore[attr-defined]
    try:
        section = make_section(path, root, page)
        return section, text(section, number, single)
    except PbcsError as error:
        if single:
            raise
        section = damaged_section(path, root, str(error))
    except Exception as error:  # whatever a folder of another person may hold
        if single:
            raise DamagedFile(f"{path} cannot be shown: {error!r}") from error
        section = damaged_section(path, root, f"{path} cannot be shown: {error!r}")
    return section, text(section, number, single)


def _templates() -> Environment:
    environment = Environment(loader=PackageLoader("pbcs_ompl.results.report"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"cell": _cell, "format_value": format_value}
    return environment


def _cell(value: Any) -> str:
    """Write a value of a table."""
    if value is None or isinstance(value, bool):
        return {None: "–", True: "yes", False: "no"}[value]
    return format_number(value)
