"""What each difference between the presets "thesis" and "fast" is worth."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, greater, higher, never, rate, sometimes
from pbcs_ompl.figures.by_row import rows_figure
from pbcs_ompl.figures.canvas import publish

Records = list[dict[str, Any]]
FIRST, ALL_BUT = "first", "all-but"
"""Kinds of rows: with the first k changes, and with all changes but the k-th."""
OURS = 'ours: what the preset "fast" is for'
LITERAL, SMALL = "as [Matheron2020]: Alg. 6 to 8", "Alg. 6 to 8 with networks of 64 units"


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw what PBCS solves and costs with the first k changes, and with all but one; say what each change is worth."""
    if not records:
        return []
    changes = list(records[0]["changes"])
    steps = [_of(records, FIRST, count) for count in range(len(changes) + 1)]
    without = [*(_of(records, ALL_BUT, count) for count in range(1, len(changes))), steps[-2]]
    names = [LITERAL, *(f"+ {name}" for name in changes)]
    _draw(dict(zip(names, steps, strict=True)), "PBCS from the thesis to the preset fast (the last row)",
          figures / "changes.png")
    _draw({"fast": steps[-1], **{f"without: {name}": runs for name, runs in zip(changes, without, strict=True)}},
          "PBCS, preset fast, without one of its differences from the thesis", figures / "without-one.png")
    return [*_literal(steps[0], steps[-1]), *_small(steps[1]),
            *(_saves(f"{name}: fewer transitions than with the changes before it alone", before, after)
              for name, before, after in zip(changes, steps, steps[1:], strict=False)),
            *(_saves(f'{name}: without it "fast" takes more transitions', runs, steps[-1])
              for name, runs in zip(changes, without, strict=True))]


def _of(records: Records, kind: str, count: int) -> Records:
    return [record for record in records if (record["kind"], record["count"]) == (kind, count)]


def _solved(records: Records, *sizes: int) -> dict[str, Any]:
    chosen = [record for record in records if not sizes or record["size"] in sizes]
    return rate(sum(record["solved"] for record in chosen), len(chosen))


def _sizes(records: Records) -> list[int]:
    return sorted({record["size"] for record in records})


def _by_size(records: Records) -> dict[str, Any]:
    return {f"{size}x{size}": _solved(records, size) for size in _sizes(records)}


def _literal(thesis: Records, fast: Records) -> list[Claim]:
    keys = {(record["size"], record["seed"]) for record in thesis}
    same = [record for record in fast if (record["size"], record["seed"]) in keys]
    return [higher('within the same budget "fast" solves more mazes than "thesis"', _solved(same), _solved(thesis),
                   ("fast", "thesis"), OURS).with_numbers(**_by_size(thesis)),
            sometimes('the preset "thesis" solves some 2x2 mazes within the budget', "2x2", _solved(thesis, 2),
                      "[Matheron2020] 7.4, which gives no budget").with_numbers(**_ends(thesis))]


def _small(runs: Records) -> list[Claim]:
    """What the algorithm of the thesis does with networks that are small enough to be tried in all mazes."""
    large = [record for record in runs if record["size"] > 2]
    return [never(f"{SMALL} solve no maze from 3x3 on within the budget", "solved", _solved(large),
                  "ours: the thesis reports 15x15 with chains of such skills, without a budget")
            .with_numbers(**_by_size(runs), **_ends(runs))]


def _ends(runs: Records) -> dict[str, Any]:
    """Return how much of the plan is covered at the end, and how many chains are complete but fail with noise."""
    covered = {f"{size}x{size}": round(float(np.median([r["covered"] for r in runs if r["size"] == size])), 3)
               for size in _sizes(runs)}
    failing = sum(r["complete"] and not r["solved"] for r in runs)
    return {"covered, median": covered, "complete, but not solved": failing}


def _saves(claim: str, more: Records, less: Records) -> Claim:
    """Claim that the first runs took more transitions than the second, maze by maze and seed by seed.

    An unsolved run counts as one that took the whole budget.
    """
    one, other = ({(r["size"], r["seed"]): _cost(r) for r in runs} for runs in (more, less))
    return (greater(claim, one, other, ("without", "with"), OURS)
            .with_numbers(solved_without=_solved(more), solved_with=_solved(less), **_by_size(less)))


def _cost(record: dict[str, Any]) -> float:
    return float(record["transitions"] if record["solved"] else record["max_transitions"])


def _draw(rows: dict[str, Records], title: str, path: Path) -> None:
    rows = {row: runs for row, runs in rows.items() if runs}
    if not rows:
        return
    sizes = sorted({record["size"] for runs in rows.values() for record in runs})
    groups = {f"{size}x{size}": {row: some for row, runs in rows.items()
                                 if (some := [r for r in runs if r["size"] == size])} for size in sizes}
    budget = max(record["max_transitions"] for runs in rows.values() for record in runs)
    publish(rows_figure(
        {"share of solved runs": {size: {row: (sum(r["solved"] for r in runs), len(runs)) for row, runs in one.items()}
                                  for size, one in groups.items()}},
        {"covered part of the plan": {size: {row: [r["covered"] for r in runs] for row, runs in one.items()}
                                      for size, one in groups.items()},
         "transitions of solved runs, thousands": {
             size: {row: [r["transitions"] / 1000 for r in runs if r["solved"]] for row, runs in one.items()}
             for size, one in groups.items()}}, title=f"{title}; at most {budget:,} transitions"), path)
