"""What holding controls saves, seed by seed."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.study import Claim, rate
from pbcs_ompl.experiments.study.paired import greater
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import save

Records = list[dict[str, Any]]
SOURCE = "ours: [Matheron2020] holds each control for one step"


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the transitions of each planner; compare each number of steps with one."""
    claims = [_replayed(records)]
    for planner in dict.fromkeys(record["planner"] for record in records):
        scenes: dict[str, Records] = {}
        for record in records:
            if record["planner"] == planner:
                scenes.setdefault(record["scene"], []).append(record)
        named = {scene: {str(hold): list(column.values()) for hold, column in _needed(chosen).items()}
                 for scene, chosen in scenes.items()}
        save(values_figure(named, xlabel="a control is held for 1 to so many steps", ylabel="transitions to the goal",
                           log=True, title=f"{planner}: held controls"), figures / f"transitions-{planner}.png")
        for scene, chosen in scenes.items():
            claims += _fewer(planner, scene, chosen)
    return claims


def _needed(records: Records) -> dict[int, dict[int, float]]:
    """Return the transitions of each seed, for each number of steps; an unsolved run has used the budget at least."""
    return {hold: {record["seed"]: float(record["transitions"]) for record in records if record["hold"] == hold}
            for hold in sorted({record["hold"] for record in records})}


def _fewer(planner: str, scene: str, records: Records) -> list[Claim]:
    needed = _needed(records)
    unsolved = {hold: sum(not record["solved"] for record in records if record["hold"] == hold) for hold in needed}
    note = "unsolved, counted with the whole budget: " + ", ".join(f"{n} with {hold}" for hold, n in unsolved.items())
    return [greater(f"{scene}: {planner} needs fewer transitions when controls are held for 1 to {hold} steps",
                    needed[1], column, ("1 step", f"1 to {hold} steps"), SOURCE, note if any(unsolved.values()) else "")
            for hold, column in needed.items() if hold > 1 and 1 in needed]


def _replayed(records: Records) -> Claim:
    solved = [record for record in records if record["solved"]]
    replayed = rate(sum(record["replay_ok"] for record in solved), len(solved))
    median = float(np.median([record["path_length"] for record in solved])) if solved else None
    return Claim("every path with held controls replays bit for bit", replayed["rate"] == 1.0 if solved else None,
                 {"replayed": replayed, "steps of a path, median": median}, "what `replay_ok` promises")
