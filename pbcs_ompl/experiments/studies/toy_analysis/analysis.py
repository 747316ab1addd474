"""Figures and claims of the analysis of 1D-Toy."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.claims import Claim, about, rate
from pbcs_ompl.figures.canvas import BAND, new_figure, publish, shade

DEVIATIONS = 4.0
"""A simulation agrees when it is nowhere further off than this many standard deviations."""
TITLES = {"walk": "random walk with sink", "p-greedy": "p-greedy random walk with sink, p = 0.1"}
DENSITIES = {"walk": "Figs. A.1, A.4", "p-greedy": "as Figs. A.1, A.4"}
SUCCESSES = {"walk": "Fig. A.2", "p-greedy": "Fig. A.3"}


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the figures and check the claims."""
    walks = [record for record in records if record["kind"] != "agents"]
    claims = []
    for record in walks:
        if record["seed"] == 0:
            _draw_densities(record, figures)
            _draw_success(record, figures)
        claims += [_success_agrees(record), _density_agrees(record)]
        if record["kind"] == "p-greedy":
            claims.append(_theorem_5(record))
    agents = next((record for record in records if record["kind"] == "agents"), None)
    greedy = next((record for record in walks if record["kind"] == "p-greedy"), None)
    return claims if agents is None or greedy is None else [*claims, *_agents(agents, greedy, figures)]


def _off(found: np.ndarray, exact: np.ndarray, trials: int) -> float:
    """Return the largest distance in standard deviations of a share of `trials`."""
    deviation = np.sqrt(np.maximum(exact * (1.0 - exact), 1e-12) / trials)
    return float((np.abs(found - exact) / deviation).max())


def _success_agrees(record: dict[str, Any]) -> Claim:
    exact, found = np.array(record["exact"]), np.array(record["found"])
    off = _off(found, exact, record["walks"])
    return Claim(f"{TITLES[record['kind']]}: the success rate is as computed, within {DEVIATIONS:g} deviations",
                 off < DEVIATIONS, {"N": record["walks"], "largest deviation": off, "after 50 steps, exact": exact[-1],
                                    "simulated": rate(round(found[-1] * record["walks"]), record["walks"])},
                 f"[Matheron2020] {SUCCESSES[record['kind']]}")


def _density_agrees(record: dict[str, Any]) -> Claim:
    counts, masses = np.array(record["counts"]), np.array(record["masses"])
    some = masses * counts.sum() >= 10.0
    off = _off(counts[some] / counts.sum(), masses[some], int(counts.sum()))
    return Claim(f"{TITLES[record['kind']]}: so is the density after {record['density_after']} steps", off < DEVIATIONS,
                 {"N": int(counts.sum()), "largest deviation": off}, f"[Matheron2020] {DENSITIES[record['kind']]}")


def _theorem_5(record: dict[str, Any]) -> Claim:
    exact, printed = np.array(record["exact"]), np.array(record["theorem_5"])
    gap = float(np.abs(exact - printed).max())
    off = _off(np.array(record["found"]), printed, record["walks"])
    return Claim("the formula of Theorem 5 as printed gives the success rate of the p-greedy walk", off < DEVIATIONS,
                 {"N": record["walks"], "largest deviation": off, "largest gap to the exact rate": gap,
                  "after 50 steps, as printed": printed[-1]}, "[Matheron2020] Theorem 5",
                 "it mixes two densities P of the walk without pauses where that of the walk itself, R, has to go on")


def _agents(agents: dict[str, Any], greedy: dict[str, Any], figures: Path) -> list[Claim]:
    first = np.array(agents["first_reward"])
    count, steps = len(first), np.arange(1, agents["steps"] + 1)
    found = ((first[:, None] > 0) & (first[:, None] <= steps)).mean(axis=0)
    exact = np.array(greedy["exact"])
    figure, axes = new_figure(7.2, 4.6)
    axes.plot(steps, exact, linewidth=2, label="p-greedy random walk, exact")
    (line,) = axes.plot(steps, found, linewidth=2, label=f"untrained DDPG with ε-greedy noise (N = {count:,})")
    bounds = np.transpose([wilson(round(share * count), count) for share in found])
    axes.fill_between(steps, *bounds, color=line.get_color(), alpha=BAND, linewidth=0)
    _finish(axes, figures / "agents.png", figure, "When the reward is found first (Fig. A.5)")
    return [about(f"untrained epsilon-greedy agents ({agents['initialisation']} initialisation) find the reward in "
                  f"{len(steps)} steps as often as the p-greedy walk", "agents", rate((first > 0).sum(), count),
                  float(exact[-1]), 0.05, "[Matheron2020] A.4.3, Fig. A.5")
            .with_numbers(**{"walk": float(exact[-1]), "within one step, agents": float(found[0]),
                             "largest first action": agents["largest_first_action"]})]


def _draw_densities(record: dict[str, Any], figures: Path) -> None:
    figure, axes = new_figure(7.2, 4.6)
    positions = np.linspace(-1.0, 8.0, 451) * 0.1
    for index, (step, density) in enumerate(record["pictures"].items()):
        axes.plot(positions, 10.0 * np.array(density), linewidth=1.5, color=shade(index, len(record["pictures"])),
                  label=f"{step} step{'s' * (step != '1')}, exact")
    counts = np.array(record["counts"])
    centres = (np.arange(-1.0, 8.0, 0.25) + 0.125) * 0.1
    axes.plot(centres, counts / counts.sum() / 0.025, ".", color="black",
              label=f"{record['density_after']} steps, simulated (N = {counts.sum():,})")
    axes.set_xlabel("state")
    axes.set_ylabel("density, reward not found before")
    axes.set_title(f"{TITLES[record['kind']]} ({DENSITIES[record['kind']]})", fontsize=10)
    axes.legend(frameon=False, fontsize=9)
    publish(figure, figures / f"densities-{record['kind']}.png")


def _draw_success(record: dict[str, Any], figures: Path) -> None:
    figure, axes = new_figure(7.2, 4.6)
    steps = np.arange(1, record["steps"] + 1)
    axes.plot(steps, record["exact"], linewidth=2, label="exact")
    axes.plot(steps, record["found"], ".", color="black", label=f"simulated (N = {record['walks']:,})")
    if record["kind"] == "p-greedy":
        axes.plot(steps, record["theorem_5"], "--", linewidth=1.5, label="Theorem 5 as printed")
    title = f"{TITLES[record['kind']]} ({SUCCESSES[record['kind']]})"
    _finish(axes, figures / f"success-{record['kind']}.png", figure, title)


def _finish(axes: Any, path: Path, figure: Any, title: str) -> None:
    axes.set_xlabel("steps")
    axes.set_ylabel("reward found")
    axes.set_ylim(0.0, 1.0)
    axes.set_title(title, fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=9)
    publish(figure, path)
