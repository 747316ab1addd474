"""Pictures of trees and the claims about their evenness."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, about, always, greater, rate
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import new_panels, publish
from pbcs_ompl.figures.maze import draw_map
from pbcs_ompl.figures.tree import draw_tree
from pbcs_ompl.resettable import make

PLANNERS = ("RRTSteered", "RRTNH", "Ex")
NAMES = {"RRTSteered": "RRT", "RRTNH": "RRT-NH"}


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw one tree of each kind; compare evenness and coverage, seed by seed."""
    _draw_trees(records, figures)
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
        box, disc = (_values(records, scene, planner, "density") for scene in ("box", "disc"))
        twice = {seed: 2.0 * value for seed, value in box.items()}
        pair = (disc, twice) if denser else (twice, disc)
        inside, doubled = "in the disc", "twice that in the box"
        names = (inside, doubled) if denser else (doubled, inside)
        claims.append(greater(f"inside the disc the tree of {name} is {'more' if denser else 'less'} than twice as "
                              "dense as there in the box", *pair, names, source))
    return claims


def _mazes(records: list[dict[str, Any]]) -> list[Claim]:
    chosen = [record for record in records if record["scene"] == "maze" and record["planner"] != "RRTSteered"]
    found = rate(sum(record["first_reward"] is not None for record in chosen), len(chosen))
    ex, rrt_nh = (_values(records, "maze", planner, "coverage") for planner in ("Ex", "RRTNH"))
    return [always("maze: Ex and RRT-NH find the reward in every run of 100 000 transitions", "found", found,
                   "[Matheron2020] Fig. 4.2"),
            *(greater(f"maze: after 5000 transitions {name} has been in more than 90 % of the cells", values,
                      dict.fromkeys(values, 0.9), (name, "bar"), "[Matheron2020] Fig. 4.3")
              for name, values in (("Ex", ex), ("RRT-NH", rrt_nh))),
            *_longer_than_optimal(chosen)]


def _longer_than_optimal(records: list[dict[str, Any]]) -> list[Claim]:
    """Fig. 4.2 shows one path of each planner; here it is the share of paths that are about as long."""
    claims = []
    for planner, name, times in (("RRTNH", "RRT-NH", 3.0), ("Ex", "Ex", 5.0)):
        ratios = [record["path_length"] / record["fewest_steps"] for record in records
                  if record["planner"] == planner and record["first_reward"] is not None]
        near = rate(sum(abs(ratio - times) <= 1.0 for ratio in ratios), len(ratios))
        claims.append(about(f"maze: the path of {name} is about {times:g} times longer than the optimal one, to within "
                            "1, in most runs", "as long", near, 0.75, 0.25, "[Matheron2020] Fig. 4.2")
                      .with_numbers(ratio_median=float(np.median(ratios)) if ratios else None,
                                    quartiles=np.quantile(ratios, (0.25, 0.75)).round(2).tolist() if ratios else None,
                                    fewest_steps=records[0]["fewest_steps"] if records else None))
    return claims


def _draw_trees(records: list[dict[str, Any]], figures: Path) -> None:
    """Draw the trees of the first seed: in box and disc, and in the maze."""
    drawn = {(record["scene"], record["planner"]): record for record in records if "states" in record}
    _draw_panels([[(drawn.get((scene, planner)), "") for planner in PLANNERS] for scene in ("box", "disc")],
                 "Trees of 2,000 transitions (Figs. 3.2 to 3.4)", figures / "trees.png")
    _draw_panels([[(drawn.get(("maze", planner)), prefix) for planner in PLANNERS[1:]] for prefix in ("found_", "")],
                 "2x2 maze: up to the first reward (Fig. 4.2), and regardless of it (Fig. 4.3)",
                 figures / "maze-trees.png")


def _draw_panels(rows: list[list[tuple[dict[str, Any] | None, str]]], title: str, path: Path) -> None:
    """Draw trees side by side; prefix "found_" for what there was at the first reward."""
    if not any(record for row in rows for record, _ in row):
        return
    figure, panels = new_panels(len(rows), len(rows[0]), 4.4 * len(rows[0]), 4.0 * len(rows))
    for axes, (record, prefix) in zip(panels, [one for row in rows for one in row], strict=True):
        if record is None or f"{prefix}states" not in record:
            axes.remove()
            continue
        model, path_found = make(record["env"], record.get("env_kwargs", {})), record.get("path") if prefix else None
        draw_map(axes, model)
        lines, _ = draw_tree(axes, model, np.array(record[f"{prefix}states"]), np.array(record[f"{prefix}parents"]),
                             path=None if path_found is None else np.array(path_found))
        name = NAMES.get(record["planner"], record["planner"])
        axes.set_title(f"{name}: {record['first_reward']:,} transitions, path of {record['path_length']} steps"
                       if prefix else f"{name}: evenness {record['evenness']:.2f}", fontsize=9)
        figure.colorbar(lines, ax=axes, shrink=0.6, pad=0.02, label="depth")
    figure.suptitle(title, fontsize=10)
    publish(figure, path)


def _draw_evenness(records: list[dict[str, Any]], figures: Path) -> None:
    scenes, planners = (list(dict.fromkeys(record[key] for record in records)) for key in ("scene", "planner"))
    publish(values_figure({NAMES.get(str(planner), str(planner)): {
        scene: list(_values(records, scene, planner, "evenness").values()) for scene in scenes}
                           for planner in planners},
                       ylabel="evenness of the tree", title="How evenly trees fill what can be reached (1: even)"),
         figures / "evenness.png")
