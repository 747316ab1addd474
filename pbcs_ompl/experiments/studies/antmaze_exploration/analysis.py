"""The empirical distributions of Fig. 3.9, where each planner has been, and the claims."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from pbcs_ompl.experiments.claims import Claim, always, at_least, greater_apart, rate
from pbcs_ompl.experiments.planner_statistics import censored
from pbcs_ompl.figures.canvas import publish
from pbcs_ompl.figures.compare import distribution_figure
from pbcs_ompl.figures.maze import map_axes
from pbcs_ompl.resettable import make

Records = list[dict[str, Any]]
OFTEN = 1 / 3
NAMES = {"RRTNH": "RRT-NH"}
FIGURE = "[Matheron2020] Fig. 3.9"
MAP = ("pbcs/Maze-v0", {"size": 2})
"""The ant's maze in cells, of 4 m: a picture of it does not need MuJoCo."""


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the distributions and one exploration of each planner; compare Ex with the others."""
    if not records:
        return []
    budget = records[0]["max_transitions"]
    planners: dict[str, Records] = {}
    for record in records:
        planners.setdefault(_name(record["planner"]), []).append(record)
        if "counts" in record:
            _draw_counts(record, figures)
    publish(distribution_figure({"AntMaze": planners}, title=f"budget {budget:,} transitions (Fig. 3.9)"),
         figures / "transitions.png")
    return [*_solved(planners, f"within {budget:,} transitions"), *_fewer(planners, budget), _replayed(records)]


def _name(planner: str) -> str:
    return NAMES.get(planner, planner)


def _solved(planners: dict[str, Records], within: str) -> list[Claim]:
    claims = []
    solved = {name: [record["transitions"] for record in runs if record["solved"]] for name, runs in planners.items()}
    if "Ex" in planners:
        found = rate(len(solved["Ex"]), len(planners["Ex"]))
        claims.append(always(f"Ex reaches the goal {within} in every seed", "solved", found, FIGURE)
                      .with_numbers(the_most_it_needed=max(solved["Ex"], default=None)))
    if "RRT-NH" in planners:
        runs = len(planners["RRT-NH"])
        missed = rate(runs - len(solved["RRT-NH"]), runs)
        claims.append(at_least(f"RRT-NH often does not reach it {within}", "not solved", missed, OFTEN, FIGURE))
    return claims


def _fewer(planners: dict[str, Records], budget: int) -> list[Claim]:
    """Compare ranks, in which a run without success has needed the budget: all of them end there, so these are ties."""
    needed = {name: np.array([censored(record, budget) for record in runs]) for name, runs in planners.items()}
    ex = needed.pop("Ex", np.empty(0))
    claims = []
    for name, others in needed.items():
        claims.append(greater_apart(f"{name} needs more transitions than Ex", others.tolist(), ex.tolist(),
                                    (name, "Ex"), FIGURE if name == "RRT-NH" else "beyond the thesis")
                      .with_numbers(**{f"solved, {name}": rate((others < budget).sum(), len(others))}))
    return claims


def _replayed(records: Records) -> Claim:
    solved = [record for record in records if record["solved"]]
    replayed = rate(sum(record["replay_ok"] for record in solved), len(solved))
    return always("every path replays bit for bit in a fresh environment", "replayed", replayed,
                  "what `replay_ok` promises")


def _draw_counts(record: dict[str, Any], figures: Path) -> None:
    model = make(*MAP)
    counts = np.array(record["counts"], dtype=float)
    outcome = "goal reached" if record["solved"] else "goal not reached"
    figure, axes = map_axes(model, f"{_name(record['planner'])}, seed {record['seed']}: nodes in each bin of (x, y), "
                                   f"in cells\nafter {record['transitions']:,} transitions, {outcome}")
    low, high = model.feature_low, model.feature_high
    image = axes.imshow(np.where(counts > 0, counts, np.nan).T, origin="lower", norm=LogNorm(1, max(2.0, counts.max())),
                        extent=(low[0], high[0], low[1], high[1]), zorder=1, interpolation="nearest")
    figure.colorbar(image, ax=axes, shrink=0.7, pad=0.02, label="nodes")
    publish(figure, figures / f"explored-{record['planner']}.png")
