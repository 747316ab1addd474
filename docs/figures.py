"""All studies that come with records, as one page with their figures and verdicts.

    python docs/figures.py

draws the figures again from the records, writes them, smaller, into docs/pictures/studies, and the page
docs/studies_pictures.md.
"""

import shutil
import tempfile
from pathlib import Path

from PIL import Image

from pbcs_ompl.cli.study import VERDICTS, in_one_line
from pbcs_ompl.experiments.run_study import run_study
from pbcs_ompl.experiments.shipped_records import PACKED
from pbcs_ompl.experiments.study import find_study, study_ids

DOCS = Path(__file__).parent
PICTURES, PAGE = DOCS / "pictures" / "studies", DOCS / "studies_pictures.md"
WIDTH, COLOURS = 1000, 256
NAMED = 8  # kinds of missing runs
HEAD = """# All studies in pictures

Made by `python docs/figures.py` from the records that come with the package; `pbcs study ID --from-records` makes the
same, in full size and as PDF. *undecided*: not enough runs to agree or to deny, with the number that would decide.
Beside a claim are the counts that decide it, and p of its test; intervals and all other numbers are in `result.json`.
[studies_figures.md](studies_figures.md) has the figures of the thesis in their order.
"""


def main() -> None:
    shutil.rmtree(PICTURES, ignore_errors=True)
    PICTURES.mkdir(parents=True)
    shown = [study for study in map(find_study, study_ids()) if (study.folder / PACKED).is_file()]
    sections = [section(study) for study in shown]
    PAGE.write_text("\n".join([HEAD, *sections]), encoding="utf-8")
    print(PAGE)


def section(study) -> str:
    """Return the text of one study, and keep its figures."""
    with tempfile.TemporaryDirectory() as folder:
        result = run_study(study, out=Path(folder) / study.id, from_records=True)
        pictures = [kept(Path(figure), study.id) for figure in result.figures]
    title = f"{study.title}." + (f" A part of its runs, {len(result.records)}: {others(result.left_out)}. "
                                 f"`pbcs study {study.id} --from-records --out DIR`, then `pbcs study {study.id} --out "
                                 f"DIR` makes these too." if result.left_out else "")
    claims = [f"* **{VERDICTS[claim['agrees']].lower()}**: {in_one_line(claim)}"
              for claim in result.summary()["agrees"]]
    figures = [f"![{path.stem.replace('-', ' ')}](pictures/studies/{path.name})" for path in pictures]
    return "\n".join([f"## {study.id}", "", title, "", *claims, "", *(f"{line}\n" for line in figures)])


def others(left_out: dict[str, int]) -> str:
    """Say which runs are missing."""
    named = ", ".join(f"{count} of {name}" for name, count in list(left_out.items())[:NAMED])
    rest = sum(list(left_out.values())[NAMED:])
    return f"without {named}{f' and {rest} others' if rest else ''}"


def kept(figure: Path, study: str) -> Path:
    """Keep a picture in fewer pixels and colours; return where."""
    target = PICTURES / f"{study}-{figure.stem}.png"
    with Image.open(figure) as image:
        image.thumbnail((WIDTH, 4 * WIDTH))
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)
    return target


if __name__ == "__main__":
    main()
