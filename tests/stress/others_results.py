"""Result folders of all kinds, and what is done with a folder that came from elsewhere."""

import contextlib
import io
import json
import os
import re
import shlex
import shutil
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.cli import main

MAZE = "--env pbcs/Maze-v0 --env-kwargs '{\"size\": 2}'"
STUDY = {
    "sweep.toml": 'title = "Heads or tails"\nseeds = 3\n',
    "study.py": '''
def runs(sweep, seeds):
    return [{"name": f"coin-{seed}", "seed": seed} for seed in range(seeds)]

def run(settings):
    return {"seed": settings["seed"], "side": settings["seed"] % 2}
''',
    "analysis.py": '''
from pbcs_ompl.experiments.claims import Claim, rate

def analyse(records, figures):
    heads = rate(sum(record["side"] for record in records), len(records))
    return [Claim("some are heads", True, {"heads": heads}, "a coin"), Claim("coins dream", None)]
''',
}
POINT = {"lines_per_world": 5, "longest": 3.0, "clearance": 0.1, "near": 0.1, "middle": 0.2, "far": 0.4, "window": 0.3,
         "goal_radius": 0.15, "patience": 15, "max_steps": 100, "advance": 0.5, "test_transitions": 2000, "effort": 0.0}
"""Settings of a follower for the point of the maze, which moves 0.1 in a step."""
ROBOT = f"""--method follow --lines random --settings '{json.dumps(POINT)}' --agent-settings '{{"hidden": [32, 32]}}'"""
COMPARE = f"compare --planners Ex SST {MAZE} --seeds 2 --max-transitions 2000"
MADE = {
    "plan": f"plan {MAZE}",
    "training": f"train {MAZE} --seed 3",
    "stopped": f"train {MAZE} --seed 3 --max-transitions 19000",
    "follow": f"train {MAZE} --method follow --seed 3",
    "robot": f"train {MAZE} {ROBOT} --max-transitions 19000",
    "evaluation": "eval runs/training --episodes 7 --epsilon 0.1",
    "comparison": COMPARE,
    "study": "study coin-toss",
}
USES = {
    "plan": ["report runs/plan", f"train {MAZE} --path runs/plan --max-transitions 1 --out again"],
    "training": ["report runs/training", "eval runs/training --episodes 3", "train --resume runs/training"],
    "stopped": ["report runs/stopped", "train --resume runs/stopped"],
    "follow": ["report runs/follow", "eval runs/follow --episodes 3", "train --resume runs/follow"],
    "robot": ["report runs/robot", f"eval runs/robot {MAZE} --episodes 3",
              "eval runs/robot --path runs/plan --episodes 3", "train --resume runs/robot"],
    "evaluation": ["report runs/evaluation"],
    "comparison": ["report runs/comparison", f"{COMPARE} --out runs/comparison"],
    "study": ["report runs/study", "study coin-toss --out runs/study"],
}
"""What a user does with each folder. A training that was stopped has used its budget, so that resuming is short."""
MEASURED = re.compile(r"seconds.*|memory.*|out|database|progress|cpu_seconds")
TIMES = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d(:\d\d)?(\+\d\d:\d\d)?|[\d.]+ (s|min|h)\b|\"seconds\": [\d.e-]+")


@dataclass(frozen=True)
class Outcome:
    """What a command did: its status, what it printed, the page it made, and the trace of what it raised."""

    status: int | None
    output: str
    complaint: str
    traceback: str = ""

    @property
    def is_named(self) -> bool:
        """Whether it refused in one line, or warned."""
        return "pbcs: error: " in self.complaint or "pbcs: warning: " in self.complaint or NAMED in self.output


NAMED = "after it was written"


def make_results(folder: Path) -> Path:
    """Make a folder of each kind in folder/runs."""
    (folder / "coin-toss").mkdir(parents=True)
    for name, text in STUDY.items():
        (folder / "coin-toss" / name).write_text(text)
    with contextlib.chdir(folder):
        for name, line in MADE.items():
            done = use(f"{line} --out runs/{name}")
            assert done.status in (0, 1), done
    return folder


def use(line: str) -> Outcome:
    """Run a command in this process."""
    output, complaint = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(complaint):
        try:
            status = main(shlex.split(line))
        except BaseException:
            return Outcome(None, output.getvalue(), complaint.getvalue(), traceback.format_exc())
    found = complaint.getvalue()
    trace = found if "Traceback" in found or "mistake in pbcs" in found else ""
    page = Path(shlex.split(line)[1], "report.html") if line.startswith("report") else None
    text = page.read_text() if page is not None and status == 0 and page.is_file() else ""
    return Outcome(status, TIMES.sub("", output.getvalue() + text), found, trace)


def uses_after(original: Path, place: Path, kind: str, change: Callable[[Path], object] | None) -> list[Outcome]:
    """Return what the uses of a folder do after a change in a copy of it.

    Args:
        original: What `make_results` made.
        place: A folder for the copy.
        kind: Which folder of results.
        change: Gets the copied folder; None to change nothing.
    """
    outcomes = []
    for line in USES[kind]:
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(original, place, symlinks=True)
        if change is not None:
            change(place / "runs" / kind)
        with contextlib.chdir(place):
            outcomes.append(use(line))
    return outcomes


def files_of(folder: Path) -> list[Path]:
    """Return the files of a folder of results that are read again, relative to it."""
    names = (path.relative_to(folder) for path in sorted(folder.rglob("*")) if path.is_file())
    return [name for name in names if name.suffix in (".json", ".toml", ".npz", ".safetensors")
            and name.name not in ("tree.npz",)]


def without_measured(value: Any) -> Any:
    """Return plain values without what is measured and so differs from run to run."""
    if isinstance(value, dict):
        return {name: without_measured(item) for name, item in value.items() if not MEASURED.fullmatch(name)}
    return [without_measured(item) for item in value] if isinstance(value, list) else value


def as_words(value: object) -> str:
    """Return plain values as one line."""
    return json.dumps(value, default=str)


def seed_of_environment() -> int:
    """Return the seed of this run of a stress test; set STRESS_SEED for other cases."""
    return int(os.environ.get("STRESS_SEED", "0"))
