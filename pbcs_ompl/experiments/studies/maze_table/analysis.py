"""The table of mazes as figures and claims."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Circle
from scipy.stats import binomtest

from pbcs_ompl.experiments.claims import (
    APART,
    SIGNIFICANCE,
    Claim,
    at_least,
    fewest_runs,
    greater,
    greater_apart,
    higher,
    never,
    no_higher,
    rate,
    sometimes,
)
from pbcs_ompl.figures.by_group import rates_figure, values_figure
from pbcs_ompl.figures.canvas import GREEN, PURPLE, RED, new_figure, new_panels, publish
from pbcs_ompl.figures.chain import draw_chain
from pbcs_ompl.figures.maze import draw_map, legend_below, project_2d
from pbcs_ompl.resettable import make

Records = list[dict[str, Any]]
ALONE = ("DDPG", "TD3")
LITERAL = "PBCS, thesis"
"""Alg. 6 to 8 to the letter."""
THIRD = 1 / 3
ONCE = "succeed once, at the end, without noise"
BARS = (((2, 3, 4, 5, 7), 0.95, "[Matheron2020] 7.4: PBCS solves mazes up to 7x7; the bar is ours"),
        ((10, 15), 0.8, "ours: beyond [Matheron2020]"))
"""Sizes, and the rate that the interval of each has to lie above: 80 of 80 and 20 of 20 do so, one less does not."""
MILLION = 1_000_000
"""[Matheron2020] 5.6: a run has to succeed within this many transitions, planning included."""
COLOURS = {True: "#e3f4e3", False: "#fbe3e3"}
"""Backgrounds of solved and unsolved pictures, as in Fig. 7.3."""


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw Figs. 7.3 and 7.4 and the rates behind them; compare the methods."""
    _draw_rates(records, figures)
    _draw_table(records, figures)
    _draw_chains([record for record in _of(records, "PBCS") if "rollout" in record], figures)
    return [*_bars(records), *_literal(records), *_alone(records), *_backplay(records), *_compared(records),
            _skills(records), *_followed(records)]


def _sizes(records: Records) -> list[int]:
    return sorted({record["size"] for record in records})


def _of(records: Records, label: str, *sizes: int) -> Records:
    return [record for record in records if record["label"] == label and (not sizes or record["size"] in sizes)]


def _solved(records: Records, key: str = "solved") -> dict[str, Any]:
    return rate(sum(record[key] for record in records), len(records))


def _by_size(records: Records, label: str) -> dict[str, Any]:
    return {f"{size}x{size}": _solved(_of(records, label, size)) for size in _sizes(_of(records, label))}


def _bars(records: Records) -> list[Claim]:
    claims = []
    for sizes, bar, source in BARS:
        solved = {f"{size}x{size}": _solved(_of(records, "PBCS", size)) for size in sizes}
        tried = [one for one in solved.values() if one["n"]]
        missed = [f"{r['size']}x{r['size']} seed {r['seed']}: {_reason(r)}" for r in _of(records, "PBCS", *sizes)
                  if not r["solved"]]
        names = ", ".join(f"{size}x{size}" for size in sizes)
        verdict = _in_all([True if one["wilson"][0] > bar else False if one["wilson"][1] < bar else None
                           for one in tried])
        fewest = min((one["n"] for one in tried), default=0)
        claims.append(Claim(f"PBCS solves more than {bar:.0%} of the mazes of each of the sizes {names} (intervals "
                            "above)", verdict, solved, source, "; ".join(missed))
                      .with_note("" if verdict is not None else f"not enough runs: {fewest} of a size"))
    return claims


def _in_all(verdicts: list[bool | None]) -> bool | None:
    """Return what follows of a claim about all cases from the verdict of each."""
    return False if False in verdicts else None if None in verdicts or not verdicts else True


def _literal(records: Records) -> list[Claim]:
    """Say how far Alg. 6 to 8 to the letter come, and where they stop."""
    chosen = _of(records, LITERAL)
    stops: dict[str, int] = {}
    for record in chosen:
        if not record["solved"]:
            stops[_reason(record)] = stops.get(_reason(record), 0) + 1
    return [sometimes("PBCS to the letter (preset thesis) solves some mazes within a million transitions", "solved",
                      _solved(chosen), "[Matheron2020] 7.4")
            .with_numbers(**_by_size(records, LITERAL), where_it_stops=stops)] if chosen else []


def _reason(record: dict[str, Any]) -> str:
    if not record["complete"]:
        return str(record["reason"])
    return (f"{record['success_rate']:.0%} of the noisy executions succeed, "
            f"{record['nominal_success_rate']:.0%} of those without noise")


def _alone(records: Records) -> list[Claim]:
    claims = []
    for label in ALONE:
        small = _of(records, label, 2)
        claims += [_fails_from_3x3(records, label, f"{label} alone"),
                   sometimes(f"{label} alone solves some 2x2 mazes within a million transitions", "solved",
                             _solved(small), "[Matheron2020] 7.4: all but the simplest mazes are too hard")
                   .with_numbers(**{ONCE: _solved(small, "succeeds")})]
    return claims


def _fails_from_3x3(records: Records, label: str, name: str) -> Claim:
    large = [record for record in _of(records, label) if record["size"] > 2]
    return (never(f"{name} solves no maze from 3x3 on within a million transitions", "solved", _solved(large),
                  "[Matheron2020] 7.4")
            .with_numbers(**{ONCE: _solved(large, "succeeds")}, **_by_size(large, label)))


def _backplay(records: Records) -> list[Claim]:
    small = _of(records, "PB", 2)
    backplay, alone = _solved(small), _solved(_of(records, "DDPG", 2))
    return [_fails_from_3x3(records, "PB", "PB"),
            at_least("PB regularly fails in 2x2 mazes, in at least one run of ten", "fails",
                     rate(backplay["n"] - backplay["successes"], backplay["n"]), 0.1, "[Matheron2020] 5.6")
            .with_numbers(**{ONCE: _solved(small, "succeeds")}),
            higher("PB solves 2x2 mazes more often than DDPG alone", backplay, alone, ("PB", "DDPG"),
                   "[Matheron2020] 5.6, Fig. 5.3")]


def _compared(records: Records) -> list[Claim]:
    """Compare PBCS with the others where both have run, by the exact McNemar test."""
    pbcs = {(r["size"], r["seed"]): r["solved"] and r["transitions"] <= MILLION for r in _of(records, "PBCS")}
    claims = []
    for label in ("PB", *ALONE, *([LITERAL] if _of(records, LITERAL) else [])):
        pairs = [(pbcs[r["size"], r["seed"]], r["solved"]) for r in _of(records, label)
                 if (r["size"], r["seed"]) in pbcs]
        ours, theirs = (sum(one > other for one, other in pairs), sum(one < other for one, other in pairs))
        chance = binomtest(ours, ours + theirs, alternative="greater").pvalue if ours + theirs else 1.0
        claims.append(Claim(f"within the same million transitions PBCS solves more mazes than {label} "
                            f"(p < {SIGNIFICANCE})",
                            True if chance < SIGNIFICANCE else False if len(pairs) >= fewest_runs(*APART) else None,
                            {"PBCS": rate(sum(one for one, _ in pairs), len(pairs)),
                             label: rate(sum(other for _, other in pairs), len(pairs)),
                             f"only PBCS, only {label}": [ours, theirs], "p (McNemar, exact)": float(chance)},
                            "[Matheron2020] 7.4", "" if len(pairs) >= fewest_runs(*APART) else
                            f"not enough runs: {len(pairs)} pairs"))
    return claims


def _followed(records: Records) -> list[Claim]:
    """Compare path following with PBCS where both have run."""
    pbcs = {(r["size"], r["seed"]): r for r in _of(records, "PBCS")}
    follow = {(r["size"], r["seed"]): r for r in _of(records, "Follow") if (r["size"], r["seed"]) in pbcs}
    both = [key for key, run in follow.items() if run["solved"] and pbcs[key]["solved"]]
    ratios = {f"{size}x{size}": float(np.median([follow[key]["transitions"] / pbcs[key]["transitions"]
                                                 for key in both if key[0] == size]))
              for size in dict.fromkeys(size for size, _ in both)}
    return [no_higher("PBCS solves no more mazes than path following", _solved([pbcs[key] for key in follow]),
                      _solved(list(follow.values())), ("PBCS", "Follow"), "ours"),
            greater("a third of PBCS's transitions is more than path following takes",
                    {key: THIRD * pbcs[key]["transitions"] for key in both},
                    {key: follow[key]["transitions"] for key in both}, ("PBCS, a third", "Follow"), "ours")
            .with_numbers(**{"ratio, median by size": ratios})]


def _skills(records: Records) -> Claim:
    """Say whether each size takes more skills than the one before it."""
    skills = {f"{size}x{size}": [r["skills"] for r in _of(records, "PBCS", size) if r["solved"]]
              for size in _sizes(records)}
    known = {size: values for size, values in skills.items() if values}
    steps = {larger: greater_apart("", known[larger], known[smaller], (larger, smaller), "")
             for smaller, larger in pairwise(known)}
    few = [size for size, step in steps.items() if step.agrees is None]
    return Claim(f"PBCS chains more skills in larger mazes (from each size to the next, p < {SIGNIFICANCE})",
                 _in_all([step.agrees for step in steps.values()]),
                 {"skills, median": {size: float(np.median(values)) for size, values in known.items()},
                  "N": {size: len(values) for size, values in known.items()}}, "[Matheron2020] 7.4, Fig. 7.4",
                 f"not enough runs: {', '.join(few) or 'none'}" if few or not steps else "")


def _draw_rates(records: Records, figures: Path) -> None:
    budgets = {record["label"]: f"{record['label']} {record['max_transitions'] / MILLION:g} M" for record in records}
    groups = {label: {f"{size}x{size}": _of(records, label, size) for size in _sizes(_of(records, label))}
              for label in budgets}
    counts = {label: {size: (sum(r["solved"] for r in runs), len(runs)) for size, runs in sizes.items()}
              for label, sizes in groups.items()}
    title = f"Solved mazes; at most {', '.join(budgets.values())} transitions"
    publish(rates_figure(counts, title=title), figures / "success.png")
    costs = {label: {size: [r["transitions"] for r in runs if r["solved"]] for size, runs in sizes.items()}
             for label, sizes in groups.items()}
    publish(values_figure(costs, title="What solved runs cost, planning included", ylabel="transitions", log=True),
         figures / "transitions.png")
    skills = {label: {f"{size}x{size}": [r["skills"] for r in _of(records, label, size) if r["solved"]]
                      for size in _sizes(records)} for label in ("PBCS", LITERAL) if _of(records, label)}
    publish(values_figure(skills, title="Skills in the chains of solved runs", ylabel="skills"), figures / "skills.png")


def _draw_table(records: Records, figures: Path) -> None:
    """Draw the first seed of every method and size, as Fig. 7.3."""
    pictured = [record for record in records if "rollout" in record]
    sizes, labels = _sizes(pictured), list(dict.fromkeys(record["label"] for record in pictured))
    figure, whole = new_figure(2.2 * max(1, len(sizes)), 2.5 * max(1, len(labels)))
    whole.remove()
    for record in pictured:
        place = labels.index(record["label"]) * len(sizes) + sizes.index(record["size"]) + 1
        _draw_one(record, figure.add_subplot(len(labels), len(sizes), place))
    figure.suptitle("Numbers: transitions; green background: solved; red: plan; green: the policy without noise; "
                    "purple: activation sets", fontsize=11)
    publish(figure, figures / "mazes.png")


def _draw_one(record: dict[str, Any], axes: Any) -> None:
    model = make("pbcs/Maze-v0", record["env_kwargs"])
    draw_map(axes, model)
    axes.set_facecolor(COLOURS[record["solved"]])
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set(xlabel="", ylabel="")
    for key, colour, width in (("plan", RED, 0.6), ("rollout", GREEN, 1.4)):
        if record[key] is not None:
            axes.plot(*project_2d(model, np.array(record[key])).T, color=colour, linewidth=width, zorder=3)
    for centre, radius in record["activations"]:
        place = tuple(project_2d(model, np.array(centre))[0])
        axes.add_patch(Circle(place, radius, fill=False, edgecolor=PURPLE, zorder=4, linewidth=0.8))
    axes.set_title(f"{record['label']} {record['size']}x{record['size']}: {record['transitions']:,}", fontsize=9)


def _draw_chains(records: Records, figures: Path) -> None:
    """Draw the chain of the first seed of each size, as Fig. 7.4."""
    if not records:
        return
    columns = min(4, len(records))
    figure, panels = new_panels(-(-len(records) // columns), columns, 4.2 * columns, 4.6 * -(-len(records) // columns))
    for axes in panels[len(records):]:
        axes.remove()
    for axes, record in zip(panels, sorted(records, key=lambda one: int(one["size"])), strict=False):
        model = make("pbcs/Maze-v0", record["env_kwargs"])
        draw_map(axes, model)
        draw_chain(axes, model, trajectory=np.array(record["plan"]), rollout=np.array(record["rollout"]),
                   activations=[(np.array(centre), radius) for centre, radius in record["activations"]])
        axes.set_title(f"{record['size']}x{record['size']}, seed {record['seed']}: {record['transitions']:,} "
                       f"transitions{'' if record['solved'] else ', not solved'}", fontsize=9)
        legend_below(axes, columns=2)
    figure.suptitle("PBCS (Fig. 7.4)", fontsize=10)
    publish(figure, figures / "chains.png")
