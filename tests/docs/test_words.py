"""One vocabulary: the words of the field, in identifiers, docstrings, comments, messages and pages alike."""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORDS = {
    r"doors?": "propagator, or interface",
    r"rooms?": "subpackage, or space",
    r"milestones?": "waypoint",
    r"learners?": "trainer, or training method",
    r"crews?": "workers",
    r"cures?|cured": "variant",
    r"anew": "again, or from scratch",
    r"mend(s|ed|ing)?": "repair, or fix",
    r"whence": "from which",
    r"tells?|told|telling": "return, report, say",
    r"nobody|somebody|anybody('s)?": "unknown, none, others, third-party",
    r"furnish(es|ed)?": "draw",
    r"descend(s|ed)?": "step of an optimiser",
    r"slopes?": "gradient",
    r"tapes?": "activations",
    r"forgets? everything|remembers?|remembered": "keep, store, add",
    r"arrives?|arrived": "succeed, reach the goal",
    r"(goes|went|going) on": "continue, resume",
    r"came of|comes of": "result",
    r"so many|so much": "N",
    r"hands? (back|out)|handed back": "return",
    r"in the midst": "in the middle",
    r"go the way": "replay",
    r"taken? off": "remove",
}
"""Words that a native-speaking engineer would stop at, and what to write instead."""
PATTERN = re.compile(r"\b(" + "|".join(WORDS) + r")\b", re.IGNORECASE)
ALLOWED = {
    "tests/docs/test_words.py": WORDS.keys(),
    "docs/environments_table.md": WORDS.keys(),  # ids and messages of others
}


def pages() -> list[str]:
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.py", "*.md", "*.toml",
                             "*.html", "Makefile"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.split() if (ROOT / name).is_file()]


def plain_words(line: str) -> str:
    """Return a line whose identifiers are split into words, without the ids of others."""
    line = line.replace("AdroitHandDoorSparse-v1", "")
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", line).replace("_", " ")


def test_the_words_are_those_of_the_field() -> None:
    found = [f"{page}:{number}: {match[0]!r} in {line.strip()[:90]!r}"
             for page in pages() if page not in ALLOWED
             for number, line in enumerate((ROOT / page).read_text().splitlines(), start=1)
             for match in PATTERN.finditer(plain_words(line))]
    assert not found, "\n".join(found)
