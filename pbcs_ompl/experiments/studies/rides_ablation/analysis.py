"""What each part of Rides saves, and how Ex and KPIECE1 compare with the whole rule."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from pbcs_ompl.core.statistics import median_interval
from pbcs_ompl.experiments.claims import Claim, always, greater, rate
from pbcs_ompl.experiments.studies.rides_ablation.study import WHOLE
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.canvas import colour, new_panels, publish

Records = list[dict[str, Any]]
Costs = dict[str, dict[str, dict[int, float]]]
"""Transitions by scene, rule and seed."""
WITHOUT = {
    "rides": "a control lasts one step",
    "scales": "bins alone, no regions around them",
    "surface-controls": "controls are uniform in their box",
    "uniform-controls": "controls are on the surface of their box",
    "stop-when-still": "a step that does not change the state does not end a ride",
    "stop-in-known-bins": "known bins in a row do not end a ride, only patience does",
    "learnt-scales": "all scales are equally likely",
}
"""What the rule does without a part."""
OURS = "ours: docs/planners.md"
COLUMNS = 3


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the transitions of every rule in every scene; compare each rule with the whole one."""
    costs: Costs = {}
    for record in records:
        rules = costs.setdefault(record["scene"], {})
        rules.setdefault(record["rule"], {})[record["seed"]] = float(record["transitions"])
    if costs:
        _draw(costs, figures)
    others = [rule for rule in dict.fromkeys(record["rule"] for record in records) if rule != WHOLE]
    solved = [record for record in records if record["solved"]]
    return [*(_compared(costs, rule) for rule in others),
            always("every plan replays bit for bit", "replayed",
                   rate(sum(bool(record["replay_ok"]) for record in solved), len(solved)), OURS)]


def _compared(costs: Costs, rule: str) -> Claim:
    """Claim that a rule needs more transitions than the whole one, over all scenes and seeds; an unsolved run has used
    the budget."""
    one, other = ({(scene, seed): cost for scene, rules in costs.items() for seed, cost in rules.get(name, {}).items()}
                  for name in (rule, WHOLE))
    part = rule.removeprefix("without-")
    sentence = (f"{rule} needs more transitions than Rides" if part == rule else
                f"Rides needs more transitions without {part.replace('-', ' ')} ({WITHOUT.get(part, part)})")
    return greater(sentence, one, other, (rule, WHOLE), OURS).with_numbers(
        by_scene={scene: _of_scene(rules[rule], rules[WHOLE]) for scene, rules in costs.items()
                  if rule in rules and WHOLE in rules})


def _of_scene(one: dict[int, float], whole: dict[int, float]) -> dict[str, Any]:
    """Return the medians of a rule and of the whole one with their intervals, the median ratio of the seeds, and the
    sign test."""
    seeds = [seed for seed in one if seed in whole]
    more, less = (sum(sign * one[seed] > sign * whole[seed] for seed in seeds) for sign in (1, -1))
    numbers: dict[str, Any] = {name: {"median": float(np.median(values)), "interval": list(median_interval(values))}
                               for name, values in (("transitions", list(one.values())),
                                                    (WHOLE, list(whole.values())))}
    if seeds:
        ratios = [one[seed] / whole[seed] for seed in seeds]
        numbers["ratio"] = {"median": float(np.median(ratios)), "interval": list(median_interval(ratios))}
    return numbers | {"more": more, "N": len(seeds),
                      "p of a sign test": float(binomtest(more, more + less).pvalue) if more + less else 1.0}


def _draw(costs: Costs, figures: Path) -> None:
    """Draw a row for each rule and a panel for each scene: every run, the median and its interval."""
    rows = -(-len(costs) // COLUMNS)
    figure, panels = new_panels(rows, min(len(costs), COLUMNS), 13.0, 3.4 * rows)
    for axes, (scene, rules) in zip(panels, costs.items(), strict=False):
        names = list(rules)[::-1]
        for place, name in enumerate(names):
            values = list(rules[name].values())
            shade = colour(0 if name == WHOLE else 1 if name.startswith("without-") else 2)
            axes.plot(values, np.full(len(values), place), ".", color=shade, alpha=0.35)
            axes.plot(median_interval(values), [place, place], color=shade, linewidth=1.6)
            axes.plot(np.median(values), place, "|", color=shade, markersize=13, markeredgewidth=2.5)
        if WHOLE in rules:
            axes.axvline(float(np.median(list(rules[WHOLE].values()))), color=colour(0), linewidth=0.8, linestyle=":")
        axes.set_yticks(range(len(names)), [name.replace("-", " ") for name in names])
        axes.set(xscale="log", title=f"{in_words(scene)} (N = {max(len(column) for column in rules.values())})")
        axes.grid(alpha=0.3, axis="x")
    for axes in panels[len(costs):]:
        axes.set_axis_off()
    figure.supxlabel("transitions to the goal (bars: medians, 95 % bootstrap)", fontsize=10)
    publish(figure, figures / "transitions.png")
