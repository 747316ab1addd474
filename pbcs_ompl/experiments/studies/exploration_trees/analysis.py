"""Pictures of trees and the claims about their evenness."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, greater, rate
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.tree import tree_figure
from pbcs_ompl.resettable import make

FIGURES = {("box", "RRTSteered"): "3.2a", ("box", "RRTNH"): "3.3a", ("box", "Ex"): "3.4a",
           ("disc", "RRTSteered"): "3.2b", ("disc", "RRTNH"): "3.3b", ("disc", "Ex"): "3.4b",
           ("maze", "RRTNH"): "4.3", ("maze", "Ex"): "4.3"}
"""Which figure of [Matheron2020] a tree is like."""


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw one tree of each kind; compare evenness and coverage, seed by seed."""
    for record in records:
        if "states" in record:
            _draw_trees(record, figures)
    _draw_evenness(records, figures)
    return [*_even_trees(records), *_samples_outside(records), *_mazes(records)]


def _values(records: list[dict[str, Any]], scene: str, planner: str, name: str) -> dict[int, Any]:
    """Return one number of each seed."""
    return {record["seed"]: record[name] for record in records
            if (record["scene"], record["planner"]) == (scene, planner)}


def _even_trees(records: list[dict[str, Any]]) -> list[Claim]:
    box, disc = ({planner: _values(records, scene, planner, "evenness") for planner in ("Ex", "RRTNH", "RRTSteered")}
                 for scene in ("box", "disc"))
    return [greater("box: the tree of RRT is more even than that of RRT-NH", box["RRTSteered"], box["RRTNH"],
                    ("RRT", "RRT-NH"), "[Matheron2020] Figs. 3.2(a), 3.3(a)"),
            greater("box: the tree of Ex is more even than that of RRT-NH", box["Ex"], box["RRTNH"], ("Ex", "RRT-NH"),
                    "our reading of [Matheron2020] Figs. 3.3(a), 3.4(a)",
                    "Ex goes deep first: it is even where it has been, and that is not everywhere after 2000 steps"),
            *(greater(f"disc: the tree of Ex is more even than that of {name}, which goes for what cannot be reached",
                      disc["Ex"], disc[planner], ("Ex", name), "[Matheron2020] Figs. 3.2(b), 3.3(b), 3.4(b)")
              for planner, name in (("RRTSteered", "RRT"), ("RRTNH", "RRT-NH")))]


def _samples_outside(records: list[dict[str, Any]]) -> list[Claim]:
    """The disc has about a fifth of the box's area; a tree that used it alone would be five times as dense."""
    claims = []
    for planner, name, denser, source in (("RRTSteered", "RRT", False, "[Matheron2020] 3.1.3"),
                                          ("RRTNH", "RRT-NH", False, "[Matheron2020] 3.1.3"),
                                          ("Ex", "Ex", True, "ours, after [Matheron2020] 3.1.3")):
        columns = [list(_values(records, scene, planner, "density").values()) for scene in ("box", "disc")]
        if all(columns):
            box, disc = (float(np.median(column)) for column in columns)
            words = "at least" if denser else "less than"
            claims.append(Claim(f"inside the disc the tree of {name} is {words} twice as dense as there in the box "
                                "(medians)", (disc >= 2.0 * box) == denser,
                                {"states per unit of area": {"box": box, "disc": disc}, "seeds": len(columns[1])},
                                source))
    return claims


def _mazes(records: list[dict[str, Any]]) -> list[Claim]:
    chosen = [record for record in records if record["scene"] == "maze" and record["planner"] != "RRTSteered"]
    found = rate(sum(record["first_reward"] is not None for record in chosen), len(chosen))
    ex, rrt_nh = (_values(records, "maze", planner, "coverage") for planner in ("Ex", "RRTNH"))
    seen = {planner: float(np.median(list(values.values()))) for planner, values in (("Ex", ex), ("RRTNH", rrt_nh))
            if values}
    return [Claim("maze: Ex and RRT-NH find the reward in every run of 100 000 transitions",
                  found["rate"] == 1.0 if chosen else None,
                  {"found": found}, "[Matheron2020] Fig. 4.2"),
            Claim("maze: after 5000 transitions both have been in at least 90 % of the cells (medians)",
                  min(seen.values()) >= 0.9 if len(seen) == 2 else None,
                  {"coverage": seen, "seeds": min(len(ex), len(rrt_nh))},
                  "[Matheron2020] Fig. 4.3")]


def _draw_trees(record: dict[str, Any], figures: Path) -> None:
    model = make(record["env"], record.get("env_kwargs", {}))
    name = f"{record['scene']}-{record['planner']}"
    title = f"{record['planner']}, {record['transitions']:,} transitions: evenness {record['evenness']:.2f}"
    number = FIGURES.get((record["scene"], record["planner"]))
    save(tree_figure(model, np.array(record["states"]), np.array(record["parents"]),
                     title=f"{title} (Fig. {number})" if number else title), figures / f"{name}.png")
    if "path" in record:
        title = f"{record['planner']} up to the first reward: {record['first_reward']:,} transitions (Fig. 4.2)"
        save(tree_figure(model, np.array(record["found_states"]), np.array(record["found_parents"]),
                         path=np.array(record["path"]), title=title), figures / f"{name}-first-reward.png")


def _draw_evenness(records: list[dict[str, Any]], figures: Path) -> None:
    scenes, planners = (list(dict.fromkeys(record[key] for record in records)) for key in ("scene", "planner"))
    save(values_figure({planner: {scene: list(_values(records, scene, planner, "evenness").values())
                                  for scene in scenes} for planner in planners},
                       ylabel="evenness of the tree", title="How evenly trees fill what can be reached (1: uniform)"),
         figures / "evenness.png")
