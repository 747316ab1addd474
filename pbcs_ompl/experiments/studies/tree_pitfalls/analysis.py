"""Claims about the pitfalls of exploration trees."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import NullFormatter

from pbcs_ompl.core.statistics import median_interval
from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.claims import Claim, greater, rate
from pbcs_ompl.experiments.studies.tree_pitfalls.study import EST_RULES, MEASURES
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import BAND, new_panels, publish

Records = list[dict[str, Any]]
NAMES = {"RRTNH": "RRT-NH"}
CONSTANT = 2.0
"""An expansion in a tree ten times as large may take up to this factor longer: caches are smaller than trees."""
DEEPER = 3.0


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw depths and seconds by the size of the tree; check what the thesis says of them."""
    kinds = {kind: [record for record in records if record["kind"] == kind]
             for kind in ("paradox", "neighbours", "growth", "est")}
    if kinds["neighbours"] and kinds["growth"]:
        _draw(kinds["neighbours"], kinds["growth"], figures)
    if kinds["est"]:
        _draw_est(kinds["est"], figures)
    return [*_paradox(kinds["paradox"]), *_neighbours(kinds["neighbours"]), *_growth(kinds["growth"]),
            *_est(kinds["est"])]


def _by_seed(records: Records, number: Any) -> dict[int, float]:
    return {record["seed"]: float(number(record)) for record in records}


def _per_expansion(record: dict[str, Any]) -> Array:
    """Return the seconds of an expansion between one size and the next: a search has a constant cost besides."""
    seconds: Array = np.diff(record["seconds"]) / np.diff(record["sizes"])
    return seconds


def _paradox(records: Records) -> list[Claim]:
    stuck, free = (_by_seed([record for record in records if record["measure"] == measure],
                            lambda record: record["from_the_middle"]) for measure in MEASURES)
    return [greater("density as the number of nodes nearby: more than 95 % of the expansions are from the middle of "
                    "the ring", stuck, dict.fromkeys(stuck, 0.95), ("share", "bar"), "[Matheron2020] 3.3.1, Fig. 3.6"),
            greater("density as the number of edges, as in Ex: less than 10 % are", dict.fromkeys(free, 0.1), free,
                    ("bar", "share"), "[Matheron2020] 3.3.1")]


def _neighbours(records: Records) -> list[Claim]:
    ordered, random = (_by_seed(records, lambda record, name=name: record["depths"][name][-1])
                       for name in ("of RRT-NH", "random"))
    bar = {seed: DEEPER * depth for seed, depth in random.items()}
    return [greater("a k-d tree that is never balanced is deeper in the order of RRT-NH than in random order", ordered,
                    random, ("mean depth, of RRT-NH", "random"), "[Matheron2020] A.3"),
            greater(f"catastrophically so: {DEEPER:g} times at least", ordered, bar,
                    ("mean depth, of RRT-NH", f"{DEEPER:g} times random"), "[Matheron2020] A.3")]


def _growth(records: Records) -> list[Claim]:
    claims = []
    for planner, bounded in (("Ex", True), ("RRTNH", False)):
        some = [record for record in records if record["planner"] == planner]
        late, early = (_by_seed(some, lambda record, at=at: _per_expansion(record)[at]) for at in (-1, 0))
        bar = {seed: CONSTANT * seconds for seed, seconds in early.items()}
        if bounded:
            claims.append(greater(f"an expansion of Ex takes O(1): in the largest tree less than {CONSTANT:g} times as "
                                  "long as in the smallest", bar, late, ("bar, s", "largest, s"),
                                  "[Matheron2020] 3.3.2"))
        else:
            claims.append(greater("one of RRT-NH takes longer in the largest tree than in the smallest", late, early,
                                  ("largest, s", "smallest, s"), "[Matheron2020] 3.3.2"))
    return claims


def _est(records: Records) -> list[Claim]:
    """Compare the rule of the text of 3.2 with that of its figure; an unsolved run counts as the whole budget."""
    costs = {rule: {(r["size"], r["seed"]): float(r["transitions"] if r["solved"] else r["max_transitions"])
                    for r in records if r["rule"] == rule} for rule in EST_RULES}
    solved = {f"solved, {rule}": rate(sum(r["solved"] for r in records if r["rule"] == rule),
                                      len(costs[rule])) for rule in EST_RULES}
    return [greater("EST needs more transitions when it draws nodes by 1 / omega than when it takes one with the "
                    "least omega", costs["draw"], costs["least"], ("draw", "least"),
                    "[Matheron2020] 3.2: its text and Fig. 3.5 contradict each other").with_numbers(**solved)]


def _draw_est(records: Records, figures: Path) -> None:
    groups = {f"EST, {rule}": {f"{size}x{size}": [r["transitions"] for r in records
                                                  if (r["rule"], r["size"]) == (rule, size) and r["solved"]]
                               for size in sorted({r["size"] for r in records})} for rule in EST_RULES}
    publish(values_figure(groups, ylabel="transitions to the goal", log=True,
                          title="EST's two rules: a node drawn by 1 / ω, or one with the least ω (3.2)"),
            figures / "est-rules.png")


def _draw(neighbours: Records, growth: Records, figures: Path) -> None:
    figure, (left, right) = new_panels(1, 2, 10.0, 4.2)
    sizes = np.array(neighbours[0]["sizes"], dtype=np.float64)
    for name in ("of RRT-NH", "random"):
        label = "order of RRT-NH" if name == "of RRT-NH" else "random order"
        _line(left, sizes, np.array([record["depths"][name] for record in neighbours]), label)
    left.plot(sizes, np.log2(sizes), "--", color="black", linewidth=1.0, label="log2 N")
    left.set(xscale="log", xlabel="nodes N", ylabel="mean depth of a node", title="Unbalanced k-d tree (A.3)")
    for planner in dict.fromkeys(record["planner"] for record in growth):
        some = [record for record in growth if record["planner"] == planner]
        _line(right, np.array(some[0]["sizes"][1:], dtype=np.float64),
              1e6 * np.array([_per_expansion(record) for record in some]), NAMES.get(str(planner), str(planner)))
    right.set(xscale="log", yscale="log", xlabel="transitions", ylabel="microseconds of an expansion",
              title="What an expansion costs (3.3.2)")
    for axes, ticks in ((left, sizes), (right, growth[0]["sizes"][1:])):
        axes.set_xticks(ticks, [f"{int(tick):,}" for tick in ticks])
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=9)
    figure.suptitle("Medians and their 95 % bootstrap intervals", fontsize=9)
    publish(figure, figures / "pitfalls.png")


def _line(axes: Any, sizes: Array, rows: Array, label: str) -> None:
    (line,) = axes.plot(sizes, np.median(rows, axis=0), marker="o", markersize=4, linewidth=1.6,
                        label=f"{label} (N = {len(rows)} seeds)")
    bounds = np.transpose([median_interval(column) for column in rows.T])
    axes.fill_between(sizes, *bounds, color=line.get_color(), alpha=BAND, linewidth=0)
