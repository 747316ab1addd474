"""Pictures of trees and the claims about their evenness."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import wilcoxon

from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.figures.tree import tree_figure
from pbcs_ompl.reset_anywhere import make
from pbcs_ompl.studies import Claim, rate

SURE = 0.05


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw one tree of each kind; compare evenness and coverage, seed by seed."""
    for record in records:
        if "states" in record:
            _draw_trees(record, figures)
    _draw_evenness(records, figures)
    return [*_even_trees(records), *_mazes(records)]


def _values(records: list[dict[str, Any]], scene: str, planner: str, name: str) -> dict[int, Any]:
    """Return one number of each seed."""
    return {record["seed"]: record[name] for record in records
            if (record["scene"], record["planner"]) == (scene, planner)}


def _greater(claim: str, first: dict[int, float], second: dict[int, float], names: tuple[str, str],
             source: str, note: str = "") -> Claim:
    """Claim that the first values are greater, by Wilcoxon's test over the seeds that both have."""
    seeds = sorted(first.keys() & second.keys())
    one, other = np.array([first[seed] for seed in seeds]), np.array([second[seed] for seed in seeds])
    chance = float(wilcoxon(one, other, alternative="greater").pvalue) if len(seeds) else 1.0
    return Claim(f"{claim} (p < {SURE})", chance < SURE if len(seeds) > 4 else None,
                 {f"median, {names[0]}": float(np.median(one)), f"median, {names[1]}": float(np.median(other)),
                  "greater": rate((one > other).sum(), len(seeds)), "p (Wilcoxon)": chance}, source,
                 note if len(seeds) > 4 else "fewer than 5 seeds: no test can tell")


def _even_trees(records: list[dict[str, Any]]) -> list[Claim]:
    box, disc = ({planner: _values(records, scene, planner, "evenness") for planner in ("Ex", "RRTNH", "RRTSteered")}
                 for scene in ("box", "disc"))
    return [_greater("box: the tree of RRT is more even than that of RRT-NH", box["RRTSteered"], box["RRTNH"],
                     ("RRT", "RRT-NH"), "[Matheron2020] Figs. 3.2(a), 3.3(a)"),
            _greater("box: the tree of Ex is more even than that of RRT-NH", box["Ex"], box["RRTNH"], ("Ex", "RRT-NH"),
                     "our reading of [Matheron2020] Figs. 3.3(a), 3.4(a)",
                     "Ex goes deep first: it is even where it has been, and that is not everywhere after 2000 steps"),
            *(_greater(f"disc: the tree of Ex is more even than that of {name}, which goes for what cannot be reached",
                       disc["Ex"], disc[planner], ("Ex", name), "[Matheron2020] Figs. 3.2(b), 3.3(b), 3.4(b)")
              for planner, name in (("RRTSteered", "RRT"), ("RRTNH", "RRT-NH")))]


def _mazes(records: list[dict[str, Any]]) -> list[Claim]:
    chosen = [record for record in records if record["scene"] == "maze" and record["planner"] != "RRTSteered"]
    found = rate(sum(record["first_reward"] is not None for record in chosen), len(chosen))
    ex, rrt_nh = (_values(records, "maze", planner, "coverage") for planner in ("Ex", "RRTNH"))
    seen = {planner: float(np.median(list(_values(records, "maze", planner, "coverage").values())))
            for planner in ("Ex", "RRTNH")}
    return [Claim("maze: Ex and RRT-NH find the reward in every run of 100 000 transitions", found["rate"] == 1.0,
                  {"found": found}, "[Matheron2020] Fig. 4.2"),
            Claim("maze: after 5000 transitions both have been in at least 90 % of the cells (medians)",
                  min(seen.values()) >= 0.9, {"coverage": seen, "seeds": min(len(ex), len(rrt_nh))},
                  "[Matheron2020] Fig. 4.3")]


def _draw_trees(record: dict[str, Any], figures: Path) -> None:
    model = make(record["env"], record.get("env_kwargs", {}))
    name = f"{record['scene']}-{record['planner']}"
    title = f"{record['planner']}, {record['transitions']:,} transitions: evenness {record['evenness']:.2f}"
    save(tree_figure(model, np.array(record["states"]), np.array(record["parents"]),
                     title=f"{title} (Fig. {record['figure']})"), figures / f"{name}.png")
    if "path" in record:
        title = f"{record['planner']} up to the first reward: {record['first_reward']:,} transitions (Fig. 4.2)"
        save(tree_figure(model, np.array(record["found_states"]), np.array(record["found_parents"]),
                         path=np.array(record["path"]), title=title), figures / f"{name}-first-reward.png")


def _draw_evenness(records: list[dict[str, Any]], figures: Path) -> None:
    figure, axes = new_figure(7.2, 4.6)
    scenes = list(dict.fromkeys(record["scene"] for record in records))
    planners = list(dict.fromkeys(record["planner"] for record in records))
    for offset, planner in enumerate(planners):
        columns = [list(_values(records, scene, planner, "evenness").values()) for scene in scenes]
        places = np.arange(len(scenes)) + 0.2 * (offset - 1)
        for place, values in zip(places, columns, strict=True):
            axes.plot(np.full(len(values), place), values, ".", color=f"C{offset}", alpha=0.5)
        axes.plot(places, [np.median(values) for values in columns], "_", color=f"C{offset}", markersize=22,
                  markeredgewidth=2.5, label=f"{planner} (N = {len(columns[0])})")
    axes.set_xticks(range(len(scenes)), scenes)
    axes.set_ylabel("evenness of the tree (1: uniform over the cells)")
    axes.set_title("How evenly the trees fill what can be reached (bars: medians)", fontsize=10)
    axes.legend(frameon=False, fontsize=9)
    save(figure, figures / "evenness.png")
