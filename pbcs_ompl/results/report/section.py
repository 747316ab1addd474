"""One result folder as a section of a report."""

import base64
import os
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

from PIL import Image

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.results.checksums import changed_files
from pbcs_ompl.results.files import CONFIG, FIGURES, RUNS, VIEW, read_bytes
from pbcs_ompl.results.folder import read_folder
from pbcs_ompl.results.report.contents import Content, Table, read_content
from pbcs_ompl.results.report.repeat import repeating, resuming, viewing

DAMAGED = "damaged"


@dataclass(frozen=True)
class Figure:
    """A picture in a result folder, and its size in pixels."""

    path: Path
    width: int
    height: int

    @property
    def data_uri(self) -> str:
        """The picture itself, as an address that needs no other file."""
        return "data:image/png;base64," + base64.b64encode(self.path.read_bytes()).decode()


def read_figure(path: Path) -> Figure:
    """Return the picture in a file.

    Raises:
        DamagedFile: it is no PNG, or one of its checksums is wrong.
    """
    try:
        with Image.open(BytesIO(read_bytes(path)), formats=["PNG"]) as image:
            size = image.size
            image.verify()
    except Exception as error:  # Pillow raises SyntaxError among others
        raise DamagedFile(f"{path} is damaged: not a PNG") from error
    return Figure(path, *size)


@dataclass(frozen=True)
class Section:
    """What a report shows of one folder.

    Attributes:
        name: The folder, as seen from that of the report.
        kind: What it holds; `DAMAGED` if it cannot be read.
        content: What it found.
        figures: Its pictures.
        settings: Its config.toml.
        versions: The versions and machines that made it.
        repeat, resume, view: Commands; "" where there is none.
        scene: The page that `view` made, as an address from the report; "" if it is not there.
    """

    name: str
    kind: str
    content: Content
    figures: list[Figure]
    settings: str
    versions: Table
    repeat: str
    resume: str
    view: str
    scene: str


def make_section(path: Path, root: Path, page: Path) -> Section:
    """Read a result folder.

    Args:
        path: The folder.
        root: The report's, `path` or a folder above it.
        page: The report.

    Raises:
        DamagedFile: a file in it is damaged.
    """
    pictures = sorted([*path.glob("*.png"), *path.glob(f"{FIGURES}/*.png")])
    _check_inside(path, [*path.glob("*.json"), *path.glob("*.toml"), *path.glob(f"{RUNS}/**/*.json"), *pictures])
    folder = read_folder(path)
    content = read_content(folder)
    changed = [(str(file), "was changed or removed after it was written") for file in changed_files(path)]
    content = replace(content, failures=[*changed, *content.failures])
    return Section(_name(path, root), folder.kind, content, [read_figure(picture) for picture in pictures],
                   read_bytes(path / CONFIG).decode("utf-8"), _versions(folder.provenance), repeating(folder),
                   resuming(folder), viewing(folder), _scene(path, page))


def _scene(folder: Path, page: Path) -> str:
    """Return where the page of `pbcs view` lies, if it is in its folder: a link, for a report runs no scripts."""
    scene = folder / VIEW
    return Path(os.path.relpath(scene, page.parent)).as_posix() if scene.is_file() and not scene.is_symlink() else ""


def _check_inside(folder: Path, files: list[Path]) -> None:
    """Refuse links that lead out of a folder: the folder of another person must not show what is on this machine.

    Raises:
        DamagedFile: there is one.
    """
    inside = folder.resolve()
    for file in files:
        if not file.resolve().is_relative_to(inside):
            raise DamagedFile(f"{file} is a link that leads out of {folder}; it is not followed")


def damaged_section(path: Path, root: Path, reason: str) -> Section:
    """Return the section of a folder that cannot be read, among others that can."""
    content = Content("A folder that cannot be read", DAMAGED, False, [], failures=[(DAMAGED, reason)])
    return Section(_name(path, root), DAMAGED, content, [], "", _versions([]), "", "", "", "")


def _name(path: Path, root: Path) -> str:
    return str(path if path == root else path.relative_to(root))


def _versions(provenance: list[dict[str, str]]) -> Table:
    """Return one column for each process that worked in a folder."""
    columns = ["", *(f"resumed {number}" if number else "started" for number in range(len(provenance)))]
    keys = list(dict.fromkeys(key for one in provenance for key in one))
    rows = [[key, *(one.get(key) for one in provenance)] for key in keys]
    return Table("Versions and machine", columns if len(provenance) > 1 else [], rows, folded=True)
