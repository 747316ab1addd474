"""The page of all studies has each study that comes with records, and each of its figures once."""

import re
from pathlib import Path

from pbcs_ompl.experiments.shipped_records import PACKED
from pbcs_ompl.experiments.study import find_study, study_ids

DOCS = Path(__file__).parents[2] / "docs"


def test_every_study_with_records_is_on_the_page():
    text = (DOCS / "studies_pictures.md").read_text()
    sections = re.findall(r"^## (\S+)$", text, flags=re.MULTILINE)
    assert sections == [name for name in study_ids() if (find_study(name).folder / PACKED).is_file()], (
        "run python docs/figures.py")
    shown = re.findall(r"\]\(pictures/studies/(\S+)\)", text)
    assert sorted(shown) == sorted(path.name for path in (DOCS / "pictures" / "studies").iterdir())
