"""What longer control durations save, seed by seed."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, always, greater, rate
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import publish

Records = list[dict[str, Any]]
SOURCE = "ours: in [Matheron2020] each control lasts one step"


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the transitions of each planner; compare each number of steps with one."""
    claims = [_replayed(records)]
    for planner in dict.fromkeys(record["planner"] for record in records):
        scenes: dict[str, Records] = {}
        for record in records:
            if record["planner"] == planner:
                scenes.setdefault(record["scene"], []).append(record)
        named = {in_words(scene): {str(duration): list(column.values()) for duration, column in _needed(chosen).items()}
                 for scene, chosen in scenes.items()}
        publish(values_figure(named, xlabel="a control lasts 1 to this many steps", ylabel="transitions to the goal",
                           log=True, title=f"{planner}: control duration"), figures / f"transitions-{planner}.png")
        for scene, chosen in scenes.items():
            claims += _fewer(planner, in_words(scene), chosen)
    return claims


def _needed(records: Records) -> dict[int, dict[int, float]]:
    """Return the transitions of each seed, for each number of steps; an unsolved run has used the budget at least."""
    return {duration: {record["seed"]: float(record["transitions"]) for record in records
                       if record["control_duration"] == duration}
            for duration in sorted({record["control_duration"] for record in records})}


def _fewer(planner: str, scene: str, records: Records) -> list[Claim]:
    needed = _needed(records)
    unsolved = {duration: sum(not record["solved"] for record in records if record["control_duration"] == duration)
                for duration in needed}
    note = ("unsolved, counted with the whole budget: "
            + ", ".join(f"{n} with {duration}" for duration, n in unsolved.items()))
    return [greater(f"{scene}: {planner} needs fewer transitions when controls last 1 to {duration} steps", needed[1],
                    column, ("1 step", f"1 to {duration} steps"), SOURCE, note if any(unsolved.values()) else "")
            for duration, column in needed.items() if duration > 1 and 1 in needed]


def _replayed(records: Records) -> Claim:
    solved = [record for record in records if record["solved"]]
    replayed = rate(sum(record["replay_ok"] for record in solved), len(solved))
    median = float(np.median([record["path_length"] for record in solved])) if solved else None
    return always("every path with longer control durations replays bit for bit", "replayed", replayed,
                  "what `replay_ok` promises").with_numbers(**{"steps of a path, median": median})
