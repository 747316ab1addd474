"""200 changes by hand in files of all kinds: each is refused by name, or the answer is the same; never a traceback."""

import json
import os
import random
import re
import tomllib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from stress.others_results import (
    Outcome,
    files_of,
    make_results,
    seed_of_environment,
    uses_after,
    without_measured,
)

CASES = 200
VALUES = [None, True, False, -1, 0, 7, 10**30, -0.5, float("nan"), float("inf"), "", "x", "evil:x", "é\n\x1b[31m",
          "a" * 5000, [], [1, "b"], {}, {"a": {"b": 1}}]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_results(tmp_path_factory.mktemp("laboratory") / "made")


def test_tampered_files(results: Path, tmp_path: Path) -> None:
    rng = random.Random(seed_of_environment())
    before = {kind: uses_after(results, tmp_path / "copy", kind, None) for kind in os.listdir(results / "runs")}
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    for case in range(CASES):
        kind = rng.choice(sorted(before))
        file = rng.choice(files_of(results / "runs" / kind))
        name, change = _change(results / "runs" / kind / file, rng)
        outcomes = uses_after(results, tmp_path / "copy", kind, lambda folder, f=file, c=change: c(folder / f))
        words = [_word(outcome, first) for outcome, first in zip(outcomes, before[kind], strict=True)]
        if name == "gone" and _is_made_again(results / "runs" / kind, tmp_path / "copy" / "runs" / kind, file):
            words = ["made again" if word == "different" else word for word in words]
        counts.update(words)
        wrong += [f"{case}: {kind}/{file}: {name}: {word}: {outcome}"
                  for word, outcome in zip(words, outcomes, strict=True) if word in ("traceback", "different")]
    print(f"\n{CASES} tampered files, {sum(counts.values())} uses of them:", dict(counts))
    assert not wrong, "\n".join(wrong[:5])


def _is_made_again(original: Path, used: Path, file: Path) -> bool:
    """Return whether a run of a study, or the result of a training, was lost and is there again, the same as before.

    Resuming a training without a result repeats it: the same settings give the same bits.
    """
    if not (file.parts[0] == "runs" or file.name == "result.json") or not (used / file).is_file():
        return False
    made, before = (json.loads((folder / file).read_text()) for folder in (used, original))
    return bool(without_measured(made) == without_measured(before))


def _word(outcome: Outcome, before: Outcome) -> str:
    if outcome.traceback:
        return "traceback"
    if outcome.is_named:
        return "named"
    return "unchanged" if (outcome.status, outcome.output) == (before.status, before.output) else "different"


def _change(path: Path, rng: random.Random) -> tuple[str, Callable[[Path], object]]:
    """Return a change of a file, and what it is in words."""
    if rng.random() < 0.2:
        return rng.choice(WHOLE)
    if path.suffix in (".json", ".toml"):
        return _change_of_values(path, rng)
    return _change_of_arrays(path, rng) if path.suffix == ".npz" else rng.choice(WHOLE)


def _replaced_by(make: Callable[[Path], object]) -> Callable[[Path], object]:
    def change(path: Path) -> None:
        path.unlink()
        make(path)

    return change


WHOLE: list[tuple[str, Callable[[Path], object]]] = [
    ("empty", lambda path: path.write_bytes(b"")),
    ("the first half", lambda path: path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])),
    ("noise", lambda path: path.write_bytes(random.Random(1).randbytes(999))),
    ("gone", lambda path: path.unlink()),
    ("a folder", _replaced_by(lambda path: path.mkdir())),
    ("a pipe", _replaced_by(os.mkfifo)),
    ("a link to nothing", _replaced_by(lambda path: path.symlink_to("nothing"))),
    ("a link that leads out", _replaced_by(lambda path: path.symlink_to("/etc/passwd"))),
    ("a device", _replaced_by(lambda path: path.symlink_to("/dev/zero"))),
    ("deep lists", lambda path: path.write_text("[" * 100_000)),
    ("deep tables", lambda path: path.write_text('{"a":' * 100_000)),
    ("a list", lambda path: path.write_text("[]")),
    ("an object", lambda path: path.write_text("{}")),
    ("a number", lambda path: path.write_text("5")),
]


def _change_of_values(path: Path, rng: random.Random) -> tuple[str, Callable[[Path], object]]:
    """Replace or remove one value, or write a key twice."""
    text = path.read_text()
    is_json = path.suffix == ".json"
    values = json.loads(text) if is_json else tomllib.loads(text)
    place, key = rng.choice(_places(values))
    kind = rng.choice(["value", "value", "value", "number", "remove", "twice"])
    if kind == "remove":
        del place[key]
        new = f"without {key}"
    elif kind == "number" and is_json:
        place[key] = "@"
        changed = json.dumps(values).replace('"@"', "1e400")
        return f"{key} = 1e400", lambda file: file.write_text(changed)
    elif kind == "twice" and is_json and re.search(r'"\w+":', text):
        first = re.search(r'"\w+":', text)
        assert first is not None
        return f"{first[0]} twice", lambda file: file.write_text(text.replace(first[0], f"{first[0]} 1, {first[0]}", 1))
    else:
        place[key] = rng.choice(VALUES if is_json else VALUES[1:])
        new = f"{key} = {place[key]!r:.40}"
    written = json.dumps(values) if is_json else tomli_w.dumps(values)
    return new, lambda file: file.write_text(written)


def _places(values: Any) -> list[tuple[Any, Any]]:
    found = []
    for key, item in list(values.items() if isinstance(values, dict) else enumerate(values)):
        found.append((values, key))
        if isinstance(item, dict | list):
            found += _places(item)
    return found


def _change_of_arrays(path: Path, rng: random.Random) -> tuple[str, Callable[[Path], object]]:
    with np.load(path) as file:
        arrays = dict(file)
    name = rng.choice(sorted(arrays))
    new: dict[str, Callable[[np.ndarray], np.ndarray | None]] = {
        "gone": lambda array: None, "text": lambda array: np.full(array.shape, "x"),
        "nan": lambda array: np.full(array.shape, np.nan), "scalar": lambda array: np.array(1.0),
        "longer": lambda array: np.concatenate([np.atleast_1d(array)] * 2),
        "another axis": lambda array: array[None], "empty": lambda array: np.atleast_1d(array)[:0],
        "huge": lambda array: np.full(array.shape, 1e300), "complex": lambda array: np.full(array.shape, 1j)}
    word = rng.choice(sorted(new))
    changed = new[word](arrays.pop(name))
    if changed is not None:
        arrays[name] = changed
    return f"{name}: {word}", lambda file: np.savez_compressed(file, **arrays)
