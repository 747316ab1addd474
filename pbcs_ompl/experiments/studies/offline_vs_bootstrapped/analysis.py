"""Figures and claims about what DDPG makes of an exploration."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection

from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.claims import Claim, always, at_least, at_most, greater, higher, rate
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.canvas import PALETTE, new_panels, publish
from pbcs_ompl.figures.critic import critic_figure
from pbcs_ompl.figures.diagnostics import curves_figure, success_figure
from pbcs_ompl.figures.maze import draw_map
from pbcs_ompl.resettable import make


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw critics and curves; compare the variants."""
    batches = [record for record in records if record["variant"] == "mini-batch"]
    trained = [record for record in records if record["variant"] != "mini-batch"]
    tables = {}
    for variant in dict.fromkeys(record["variant"] for record in trained):
        chosen = [record for record in trained if record["variant"] == variant]
        tables[variant] = (np.array(chosen[0]["at"]), np.concatenate([r["success"] for r in chosen], axis=1) > 0)
        _draw(next((record for record in chosen if 0 in record["seeds"]), chosen[0]), figures)
    panels = {"offline": [name for name in tables if name.startswith("offline")],
              "with steps of its own": [name for name in tables if not name.startswith("offline")]}
    publish(success_figure({words: {in_words(name): tables[name] for name in names} for words, names in panels.items()},
                           title="2x2 and 3x3 maze: solved by the policy without noise",
                           xlabel="steps of each seed; offline DDPG: updates"), figures / "success.png")
    ever = {variant: rate(success.any(axis=0).sum(), success.shape[1]) for variant, (_, success) in tables.items()}
    last = {variant: rate(success[-1].sum(), success.shape[1]) for variant, (_, success) in tables.items()}
    return [*_alone(ever, last), *_compared(ever, last, tables), *_walls(ever, last), *_mechanism(trained, figures),
            *(_little_of_the_wall(record, figures) for record in batches[-1:])]


def _alone(ever: dict[str, Any], last: dict[str, Any]) -> list[Claim]:
    thick = "the walls are 0.1 thick here; layer norm decides, see the variants without it"
    expected = {
        "plain": ("DDPG alone does not solve the 2x2 maze within 10 000 steps", False, "Fig. 4.1", ""),
        "offline": ("offline DDPG does not solve the 2x2 maze", False, "Fig. 4.4", thick),
        "offline-without-layer-norm": ("nor does it without layer norm", False, "Fig. 4.4", ""),
        "offline-plain-inputs": ("nor does it with torch's initialisation and plain inputs", False, "Fig. 4.4", ""),
        "bootstrapped": ("bootstrapped DDPG solves the 2x2 maze at some time", True, "Fig. 4.5", ""),
        "bootstrapped-without-layer-norm": ("so it does without layer norm", True, "Fig. 4.5", ""),
        "bootstrapped-3x3": ("in the 3x3 maze bootstrapped DDPG falls short", False, "Fig. 4.6, for a larger maze", "")}
    return [(at_least if solves else at_most)(f"{claim}, in {'more' if solves else 'less'} than half of the seeds",
                                              "solved at some evaluation", ever[variant], 0.5,
                                              f"[Matheron2020] {source}")
            .with_numbers(solved_at_the_last=last[variant]).with_note(note)
            for variant, (claim, solves, source, note) in expected.items() if variant in ever]


def _compared(ever: dict[str, Any], last: dict[str, Any], tables: dict[str, Any]) -> list[Claim]:
    claims = []
    for ending in ("", "-without-layer-norm"):
        one, other = f"bootstrapped{ending}", f"offline{ending}"
        if {one, other} <= set(ever):
            steps, success = tables[one]
            first = [int(steps[row.argmax()]) for row in success.T if row.any()]
            claims.append(higher(f"{one} DDPG solves the 2x2 maze more often than {other} DDPG", ever[one], ever[other],
                                 (one, other), "[Matheron2020] 4.5")
                          .with_numbers(**{"first solved, median of the steps":
                                           float(np.median(first)) if first else None}))
            claims.append(always(f"what {one} DDPG has solved it keeps (at the last evaluation, of those ever solved)",
                                 "kept", rate(last[one]["successes"], ever[one]["successes"]), "[Matheron2020] 4.6"))
    return claims


def _walls(ever: dict[str, Any], last: dict[str, Any]) -> list[Claim]:
    """Section 4.7: what a wall costs and where a step into it ends."""
    words = {"bootstrapped-without-penalty": "without the wall penalty", "bootstrapped-sliding":
             "with steps that slide up to the wall"}
    return [higher(f"bootstrapped DDPG solves the 2x2 maze more often with the thesis's walls than {text}",
                   ever["bootstrapped"], ever[variant], ("bootstrapped", variant), "[Matheron2020] 4.7: it may matter")
            .with_numbers(solved_at_the_last={name: last[name] for name in ("bootstrapped", variant)})
            for variant, text in words.items() if {variant, "bootstrapped"} <= set(ever)]


def _mechanism(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Section 4.6: wall hits become frequent, the critic falls along the wall; in a larger maze it forgets the goal."""
    observed = {variant: {name: np.concatenate([record["observed"][name] for record in records
                                                if record["variant"] == variant], axis=1)
                          for name in ("wall_hits", "wall_value", "goal_value")}
                for variant in ("bootstrapped", "bootstrapped-3x3")
                if any(record["variant"] == variant for record in records)}
    claims = []
    if "bootstrapped" in observed:
        hits, values = observed["bootstrapped"]["wall_hits"], observed["bootstrapped"]["wall_value"]
        claims += [_rows_differ("hits of walls become more frequent in the mini-batches of bootstrapped DDPG after its "
                                "first steps than in the exploration", hits[1], hits[0], ("then", "exploration")),
                   _rows_differ("its critic falls along the inner wall (going straight into it) from then to the end",
                                values[1], values[-1], ("after its first steps", "at the end"))]
    if "bootstrapped-3x3" in observed:
        goal = observed["bootstrapped-3x3"]["goal_value"]
        forgotten = goal[-1] < 0.5 * goal.max(axis=0)
        claims.append(at_least("in the 3x3 maze the critic forgets the reward: Q in the goal ends below half of its "
                               "maximum, in most seeds", "forgotten", rate(forgotten.sum(), len(forgotten)), 0.5,
                               "[Matheron2020] 4.6, Fig. 4.6"))
    for variant, panels in observed.items():
        at = np.array(next(record["at"] for record in records if record["variant"] == variant), dtype=np.float64)
        publish(curves_figure(at, {"share of wall hits in the replay buffer": panels["wall_hits"],
                                   "Q along the wall, into it": panels["wall_value"],
                                   "Q in the goal": panels["goal_value"]}, xlabel="steps of each seed",
                              title=f"{variant}: what 4.6 says of mini-batches and the critic"),
                figures / f"mechanism-{variant}.png")
    return claims


def _rows_differ(claim: str, more: Array, less: Array, names: tuple[str, str]) -> Claim:
    return greater(claim, dict(enumerate(more.tolist())), dict(enumerate(less.tolist())), names, "[Matheron2020] 4.6")


def _little_of_the_wall(record: dict[str, Any], figures: Path) -> Claim:
    _draw_mini_batch(record, figures)
    count = record["explored"] * len(record["seeds"])
    inside = rate(sum(record["stopped_inside"]), count)
    return (at_most("at most one in twenty of Ex's transitions shows the inner wall of the 2x2 maze",
                    "stopped by the inner wall", inside, 0.05, "[Matheron2020] 4.7, Fig. 4.7")
            .with_numbers(stopped_by_any_wall=rate(sum(record["stopped"]), count))
            .with_note("what can be learnt from them all the same: see offline DDPG"))


def _draw_mini_batch(record: dict[str, Any], figures: Path) -> None:
    model = make("pbcs/Maze-v0", {"size": record["size"]})
    before, after = (np.array(states) for states in record["batch"])
    figure, (left, right) = new_panels(1, 2, 8.4, 4.4)
    draw_map(left, model)
    segments = list(np.stack([before, after], axis=1))
    for panel in (left, right):
        panel.add_collection(LineCollection(segments, color=PALETTE[0], linewidth=1.2, zorder=3))
        panel.plot(*after.T, ".", color=PALETTE[0], markersize=3, zorder=3)
        panel.set(xlim=left.get_xlim(), ylim=left.get_ylim(), aspect="equal")
    figure.suptitle(f"{len(before)} of {record['explored']:,} transitions of Ex, with and without the maze (Fig. 4.7)",
                    fontsize=10)
    publish(figure, figures / "mini-batch.png")


def _draw(record: dict[str, Any], figures: Path) -> None:
    model = make("pbcs/Maze-v0", {"size": record["size"]})
    for picture in record["pictures"]:
        values, actions = np.array(picture["values"]), np.array(picture["actions"])
        policy = _looked_up(actions, float(model.state_high[0]))
        value = _values_of_states(_looked_up(values[:, None], float(model.state_high[0])))
        title = (f"{record['variant']}, seed {record['seeds'][0]}: {record['explored']:,} transitions of Ex,\n"
                 f"{record['updates']:,} updates on them, {picture['steps']:,} steps (Fig. {record['figure']})")
        figure = critic_figure(model, policy, value, rollout=np.array(picture["rollout"]), title=title)
        ending = "" if picture["steps"] == record["steps"] else f"-{picture['steps']}"
        publish(figure, figures / f"critic-{record['variant']}{ending}.png")


def _values_of_states(look_up: Callable[[Array], Array]) -> Callable[[Array, Array], Array]:
    """Return a critic that ignores the actions."""
    return lambda observations, _: look_up(observations)[:, 0]


def _looked_up(table: Array, extent: float) -> Callable[[Array], Array]:
    """Return a function of positions that looks them up in a table of a square grid, row by row."""
    count = int(np.sqrt(len(table)))

    def look_up(positions: Array) -> Array:
        column, row = np.clip((positions / extent * count).astype(int), 0, count - 1).T
        values: Array = table[row * count + column]
        return values

    return look_up
