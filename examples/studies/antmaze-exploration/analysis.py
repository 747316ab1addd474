"""The empirical distributions of Fig. 3.9, where each planner has been, and the claims."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from scipy.stats import mannwhitneyu

from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.compare import distribution_figure
from pbcs_ompl.figures.maze import stage
from pbcs_ompl.reset_anywhere import make
from pbcs_ompl.studies import Claim, rate

SURE = 0.05
OFTEN = 1 / 3
NAMES = {"RRTNH": "RRT-NH"}
FIGURE = "[Matheron2020] Fig. 3.9"
BEYOND = "beyond the thesis"


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the distributions and one exploration of each planner; compare Ex with the others."""
    budget = records[0]["max_transitions"]
    planners = {name: [record for record in records if record["planner"] == name]
                for name in dict.fromkeys(record["planner"] for record in records)}
    found = {name: [record["transitions"] if record["solved"] else None for record in runs]
             for name, runs in planners.items()}
    runs = {_name(name): runs for name, runs in planners.items()}
    save(distribution_figure({"AntMaze": runs}, title=f"budget {budget:,} transitions (Fig. 3.9)"),
         figures / "transitions.png")
    for record in records:
        if "counts" in record:
            _draw_counts(record, figures)
    return [*_solved(found, budget), *_fewer(found, budget), _replayed(records)]


def _name(planner: str) -> str:
    return NAMES.get(planner, planner)


def _solved(found: dict[str, list[int | None]], budget: int) -> list[Claim]:
    claims, within = [], f"within {budget:,} transitions"
    solved = {name: rate(sum(n is not None for n in runs), len(runs)) for name, runs in found.items()}
    if "Ex" in found:
        needed = [n for n in found["Ex"] if n is not None]
        claims.append(Claim(f"Ex reaches the goal {within} in every seed", solved["Ex"]["rate"] == 1.0,
                            {"solved": solved["Ex"], "the most it needed": max(needed, default=None)}, FIGURE))
    if "RRTNH" in found:
        missed = rate(solved["RRTNH"]["n"] - solved["RRTNH"]["successes"], solved["RRTNH"]["n"])
        claims.append(Claim(f"RRT-NH often does not reach it {within} (at least a third of the seeds)",
                            missed["rate"] >= OFTEN, {"not solved": missed}, FIGURE))
    return claims


def _fewer(found: dict[str, list[int | None]], budget: int) -> list[Claim]:
    """Compare medians; a run without success counts as the budget, which is too little."""
    needed = {name: np.array([budget if n is None else n for n in runs]) for name, runs in found.items()}
    ex = needed.get("Ex", np.empty(0))
    return [Claim(f"Ex needs fewer transitions than {_name(other)} (Mann-Whitney, p < {SURE})",
                  *_test(ex, runs), FIGURE if other == "RRTNH" else BEYOND,
                  "" if min(len(ex), len(runs)) > 4 else "fewer than 5 seeds: no test can tell")
            for other, runs in needed.items() if other != "Ex"]


def _test(ex: np.ndarray, other: np.ndarray) -> tuple[bool | None, dict[str, Any]]:
    if not len(ex):
        return None, {"seeds": [0, len(other)]}
    chance = float(mannwhitneyu(ex, other, alternative="less").pvalue)
    medians = [float(np.median(ex)), float(np.median(other))]
    return chance < SURE if min(len(ex), len(other)) > 4 else None, {
        "medians": medians, "ratio": medians[1] / medians[0], "seeds": [len(ex), len(other)], "p": chance}


def _replayed(records: list[dict[str, Any]]) -> Claim:
    solved = [record for record in records if record["solved"]]
    replayed = rate(sum(record["replay_ok"] for record in solved), len(solved))
    return Claim("every path replays bit for bit in a fresh environment", replayed["rate"] == 1.0 if solved else None,
                 {"replayed": replayed}, "what `replay_ok` promises")


def _draw_counts(record: dict[str, Any], figures: Path) -> None:
    model = make("pbcs/AntMaze-v0", record["env_kwargs"])
    counts = np.array(record["counts"], dtype=float)
    outcome = "goal reached" if record["solved"] else "goal not reached"
    figure, axes = stage(model, f"{_name(record['planner'])}, seed {record['seed']}: nodes in each bin of (x, y)\n"
                                f"after {record['transitions']:,} transitions, {outcome}")
    low, high = model.feature_low, model.feature_high
    image = axes.imshow(np.where(counts > 0, counts, np.nan).T, origin="lower", norm=LogNorm(1, max(2.0, counts.max())),
                        extent=(low[0], high[0], low[1], high[1]), zorder=1, interpolation="nearest")
    figure.colorbar(image, ax=axes, shrink=0.7, pad=0.02, label="nodes")
    save(figure, figures / f"explored-{record['planner']}.png")
