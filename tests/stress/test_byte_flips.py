"""200 bytes changed in files of all kinds: the damage is named or the answer is the same; never another answer."""

import os
import random
from collections import Counter
from pathlib import Path

import pytest
from stress.others_results import files_of, make_results, seed_of_environment, uses_after

FLIPS = 200

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_results(tmp_path_factory.mktemp("laboratory") / "made")


def test_byte_flips(results: Path, tmp_path: Path) -> None:
    rng = random.Random(seed_of_environment())
    before = {kind: uses_after(results, tmp_path / "copy", kind, None) for kind in os.listdir(results / "runs")}
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    for case in range(FLIPS):
        kind = rng.choice(sorted(before))
        file = rng.choice(files_of(results / "runs" / kind))
        offset, bit = rng.randrange((results / "runs" / kind / file).stat().st_size), rng.randrange(8)

        def flip(folder: Path, file: Path = file, offset: int = offset, bit: int = bit) -> None:
            content = bytearray((folder / file).read_bytes())
            content[offset] ^= 1 << bit
            (folder / file).write_bytes(content)

        for outcome, first in zip(uses_after(results, tmp_path / "copy", kind, flip), before[kind], strict=True):
            same = (outcome.status, outcome.output) == (first.status, first.output)
            word = "named" if outcome.is_named else "unchanged" if same else "different"
            word = "traceback" if outcome.traceback else word
            counts[word] += 1
            if word in ("traceback", "different"):
                wrong.append(f"{case}: {kind}/{file} byte {offset} bit {bit}: {word}: {outcome}")
    print(f"\n{FLIPS} byte flips, {sum(counts.values())} uses:", dict(counts))
    assert not wrong, "\n".join(wrong[:5])
