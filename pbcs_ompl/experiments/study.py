"""A study as a folder: `sweep.toml` says what is run, `study.py` how, `analysis.py` what follows from the records."""

import importlib.util
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from pbcs_ompl.core.errors import DamagedFile, InvalidOption, PbcsError, UnknownName
from pbcs_ompl.core.plain import plain
from pbcs_ompl.experiments.claims import Claim
from pbcs_ompl.experiments.run import Record, Run, check_number_of_seeds
from pbcs_ompl.results.files import read_toml

SWEEP, SCRIPT, ANALYSIS = "sweep.toml", "study.py", "analysis.py"
STUDIES = Path(__file__).parent / "studies"
Settings = dict[str, Any]
"""What `study.py` says of a run: plain values, with a "name" that no other run of the study has."""


@dataclass(frozen=True)
class Study:
    """An experiment.

    Attributes:
        id: The name of its folder.
        folder: Where its three files lie.
        title: One line, from the sweep.
        seeds: How many seeds it has by default, from the sweep.
        sweep: The rest of the sweep.
        runs: From the sweep and a number of seeds to the settings of every run; in `study.py`.
        run: From settings to a record; called in another process; in `study.py`.
        analyse: From all records and a folder for figures to claims; in `analysis.py`.
    """

    id: str
    folder: Path
    title: str
    seeds: int
    sweep: dict[str, Any]
    runs: Callable[[dict[str, Any], int], list[Settings]]
    run: Callable[[Settings], Record]
    analyse: Callable[[list[Record], Path], list[Claim]]

    def all_runs(self, seeds: int | None = None) -> list[Run]:
        """Return every run.

        Args:
            seeds: How many seeds; None for the default.

        Raises:
            InvalidOption: fewer than one seed.
            PbcsError: there are no runs, their names cannot name files, their settings are not plain values, or
                `study.py` does not run or lacks a function.
            MissingDependency: the runs need a library that is not installed.
        """
        settings = self.runs(self.sweep, self.number_of_seeds(seeds))
        names = [str(one.get("name", "")) for one in settings]
        if not names or len(set(names)) < len(names) or not all(map(_can_name_a_file, names)):
            raise PbcsError(f"the runs of a study need names of their own, without slashes; got {names[:5]}")
        try:
            json.dumps(settings, default=plain)
        except TypeError as error:
            raise PbcsError(f"the settings of the runs of {self.id} must be plain values: {error}") from error
        return [Run(name, one) for name, one in zip(names, settings, strict=True)]

    def number_of_seeds(self, seeds: int | None) -> int:
        """Return how many seeds are run: `seeds`, or the default where it is None.

        Raises:
            InvalidOption: fewer than one, or too many.
        """
        return check_number_of_seeds(self.seeds if seeds is None else seeds)

    def on_device(self, device: str) -> "Study":
        """Return the same study with its agents on another device: "cpu" or "cuda".

        Raises:
            InvalidOption: the sweep has no "device", or there is no such device.
        """
        from pbcs_ompl.agents.update import choose_device  # many studies need no torch

        if "device" not in self.sweep:
            raise InvalidOption(f"{self.id} has no agents whose device could be chosen; leave out device {device!r}")
        choose_device(device)
        return replace(self, sweep=self.sweep | {"device": device})


def study_ids() -> dict[str, str]:
    """Return the titles of all studies of the package, by id."""
    return {name: str(_sweep(folder).get("title", "")) for name, folder in sorted(study_folders().items())}


def find_study(name: str | Path) -> Study:
    """Return the study of this id, or in the folder of this name. Its `study.py` is imported when runs are asked for.

    Raises:
        UnknownName: there is none; the closest is suggested.
        DamagedFile: the sweep does not parse, or lacks `title` or `seeds`.
        PbcsError: `analysis.py` does not run, or lacks a function.
    """
    folder = Path(name) if (Path(name) / SCRIPT).is_file() else study_folders().get(str(name))
    if folder is None:
        raise UnknownName("study", str(name), study_folders())
    sweep = _sweep(folder)
    script = cache(lambda: _load(folder / SCRIPT, "runs", "run"))  # runs may need torch, figures do not
    analysis = _load(folder / ANALYSIS, "analyse")
    for key in ("title", "seeds"):
        if key not in sweep:
            raise DamagedFile(f"{folder / SWEEP} lacks {key!r}")
    title, seeds = sweep.pop("title"), sweep.pop("seeds")
    study_id = folder.resolve().name.replace("_", "-")
    return Study(study_id, folder, title, seeds, sweep, lambda values, count: script().runs(values, count),
                 lambda settings: script().run(settings), analysis.analyse)


def study_folders() -> dict[str, Path]:
    """Return the folders of all studies of the package, by id."""
    return {path.parent.name.replace("_", "-"): path.parent for path in STUDIES.glob(f"*/{SCRIPT}")}


def _sweep(folder: Path) -> dict[str, Any]:
    return read_toml(folder / SWEEP)


def _load(path: Path, *functions: str) -> ModuleType:
    """Import a script of a study, which must have these functions; under a name of its own outside of the package."""
    if path.parent.parent == STUDIES:
        return import_module(f"pbcs_ompl.experiments.studies.{path.parent.name}.{path.stem}")
    name = f"pbcs_study_{path.resolve().parent.name}_{path.stem}".replace("-", "_")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise PbcsError(f"cannot import {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except PbcsError:
        raise
    except Exception as error:
        raise PbcsError(f"{path} does not run: {type(error).__name__}: {error}") from error
    missing = [function for function in functions if function not in vars(module)]
    if missing:
        raise PbcsError(f"{path} lacks {', '.join(missing)}")
    return module


def _can_name_a_file(name: str) -> bool:
    return bool(name) and "/" not in name and name.isprintable()
