"""Folders that name a module in every field that is text, with that module beside them: it is never imported."""

import json
import os
import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from stress.others_results import files_of, make_results, uses_after

NAMES = ("evil:Maze-v0", "evil.sub:f")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def test_hostile_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = make_results(tmp_path / "made")
    (results / "evil.py").write_text(f"open({str(tmp_path / 'PWNED')!r}, 'w').write('1')\n")
    monkeypatch.syspath_prepend(str(tmp_path / "copy"))  # the module would be found
    counts: Counter[str] = Counter()
    for kind in os.listdir(results / "runs"):
        for file in files_of(results / "runs" / kind):
            if file.suffix not in (".json", ".toml"):
                continue
            for name in NAMES:
                for text in _with_name(results / "runs" / kind / file, name):
                    def write(folder: Path, file: Path = file, text: str = text) -> None:
                        (folder / file).write_text(text)

                    for outcome in uses_after(results, tmp_path / "copy", kind, write):
                        counts["named" if outcome.is_named else "shown"] += 1
                        assert not outcome.traceback, (kind, file, outcome)
                        assert not (tmp_path / "PWNED").exists(), (kind, file, outcome)
                        assert "evil" not in sys.modules
    print("\nuses of hostile folders:", dict(counts))


def _with_name(path: Path, name: str) -> list[str]:
    """Return the texts of a file in which one field, or all fields, that are text are the name of a module."""
    is_json = path.suffix == ".json"
    read: Any = json.loads if is_json else tomllib.loads
    write: Any = json.dumps if is_json else tomli_w.dumps
    count = len(_texts(read(path.read_text())))
    versions = []
    for chosen in ([*range(count)], *([one] for one in range(min(count, 12)))):
        values = read(path.read_text())
        for one in chosen:
            place, key = _texts(values)[one]
            place[key] = values.get("kind") if key == "kind" else name
        versions.append(write(values))
    return versions


def _texts(values: Any) -> list[tuple[Any, Any]]:
    found = []
    for key, item in list(values.items() if isinstance(values, dict) else enumerate(values)):
        if isinstance(item, str):
            found.append((values, key))
        elif isinstance(item, dict | list):
            found += _texts(item)
    return found
