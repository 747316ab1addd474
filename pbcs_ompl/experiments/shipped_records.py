"""Records that come with a study, so that its figures and claims are made again in seconds.

They lie beside `study.py`, compressed. `python -m pbcs_ompl.experiments.shipped_records OUT` packs those of a study
that was run in OUT into the folder of that study.
"""

import json
import lzma
import sys
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.core.errors import DamagedFile, InvalidOption
from pbcs_ompl.experiments.records import read_records
from pbcs_ompl.experiments.run import Record, Run
from pbcs_ompl.experiments.study import Study, find_study
from pbcs_ompl.results.files import read_bytes, read_toml, to_json, write_atomically

PACKED = "records.json.xz"


class ShippedRecords(NamedTuple):
    """What comes with a study.

    Attributes:
        seeds: With how many seeds it was run.
        left_out: How many of its runs have no record, by the names of runs without their numbers.
        records: By the names of their runs.
    """

    seeds: int
    left_out: dict[str, int]
    records: dict[str, Record]


def shipped_records(study: Study) -> ShippedRecords:
    """Return the records that come with a study. What its runs need, such as torch, is not imported.

    Raises:
        InvalidOption: the study comes without records.
        DamagedFile: their file cannot be read.
    """
    file = study.folder / PACKED
    if not file.is_file():
        raise InvalidOption(f"{study.id} comes without records; run it: pbcs study {study.id}")
    try:
        packed: dict[str, Any] = json.loads(lzma.decompress(read_bytes(file)))
        return ShippedRecords(int(packed["seeds"]), dict(packed["left_out"]), dict(packed["records"]))
    except (lzma.LZMAError, ValueError, KeyError, TypeError) as error:
        raise DamagedFile(f"{file} does not hold the records of a study: {error}") from error


def runs_without_record(runs: Sequence[Run], records: Collection[str]) -> dict[str, int]:
    """Return how many runs have no record, by their names without the number at the end."""
    return dict(Counter(run.name.rpartition("-")[0] for run in runs if run.name not in records))


def pack(out: Path) -> Path:
    """Pack the records of a study that was run in `out` into the folder of the study; return the file.

    Raises:
        UnknownName, DamagedFile: `out` does not hold a study, or one that is not here.
    """
    config = read_toml(out / "config.toml")
    study, seeds = find_study(config.get("folder") or config["study"]), int(config["seeds"])
    runs = study.all_runs(seeds)
    records = read_records(out, runs)
    text = to_json({"seeds": seeds, "left_out": runs_without_record(runs, records), "records": records}).encode()
    file = study.folder / PACKED
    write_atomically(file, lambda stream: stream.write(lzma.compress(text, preset=9)))
    return file


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        print(pack(Path(folder)))
