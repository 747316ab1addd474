"""Figures of the deadlock study."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.studies.deadlock.variants import ARGMAX, GREEDY, OU, REGRESSION, SAC, TD3, Variant
from pbcs_ompl.experiments.training_curves import joined_rows
from pbcs_ompl.figures.canvas import colour, new_panels, publish
from pbcs_ompl.figures.diagnostics import curves_figure, stuck_critic_figure, success_figure

OBSERVED = {"saturation": "saturated actions", "flat_share": "flat share", "deadlock_index": "deadlock index",
            "distance_to_returns": "mean |Q - Q^π|"}
NOISES = {"(a) noises": (GREEDY, OU), "(b) optimal behaviour from step 20,000 on": (
    GREEDY, OU, f"{GREEDY}-expert", f"{OU}-expert")}
ALGORITHMS = {"(a) DDPG-argmax": (GREEDY, ARGMAX), "(b) SAC": (GREEDY, SAC), "TD3 and the regression of Eq. 6.5": (
    GREEDY, TD3, REGRESSION)}
"""The variants in each panel."""
SLICED_STATES = (0.0, 0.05, 0.1, 0.3)
BINS = (0, 50, 100, 200, 400, 800, 1600)
"""Steps of the first reward that are distinguished, as powers of two of the longest episode."""
MINI_BATCHES = 50 * 100
"""Transitions that are drawn after an episode without the reward: 50 mini-batches of 100."""
OF_THE_THESIS = 6.03
"""Rewards among them on average, in a failed seed of the thesis."""
DRIFTING = 10
"""Seeds in the picture of drift, as in the thesis."""


def draw_drift(drift: dict[str, Any], figures: Path) -> None:
    """Draw max |Q| and max |pi| of some seeds without any reward."""
    panels = {name: np.array(drift[key])[:, :DRIFTING]
              for name, key in (("max |Q|", "largest_value"), ("max |π|", "largest_action"))}
    updates = np.array(drift["updates"], dtype=np.float64)
    publish(curves_figure(updates, panels, title="Drift: no reward at all (Fig. 6.4); the first of "
                          f"{len(drift['largest_value'][0])} seeds"), figures / "drift.png")


def draw(variants: dict[str, Variant], figures: Path) -> None:
    """Draw success, first rewards, and what failed seeds look like."""
    leaving = _leaving(variants)
    for words, panels, file in ((f"1D-Toy (Fig. 6.2){leaving}", NOISES, "success"),
                                (f"1D-Toy (Fig. 6.10a, b){leaving}", ALGORITHMS, "algorithms")):
        curves = {title: {variants[name].name: (variants[name].steps, variants[name].success)
                          for name in names if name in variants} for title, names in panels.items()}
        shown = {title: one for title, one in curves.items() if one}
        if shown:
            publish(success_figure(shown, title=words), figures / f"{file}.png")
    _draw_first_rewards(variants, figures)
    _draw_rewarded(variants, figures)
    for name, chosen in variants.items():
        if chosen.failed_with_reward.any():
            _draw_failed(name, chosen, figures)


def _draw_failed(name: str, chosen: Variant, figures: Path) -> None:
    """Draw the diagnostics of failed seeds that have met the reward, and one critic."""
    rows, observed = chosen.failed_with_reward, [record["observed"] for record in chosen.records]
    panels = {title: joined_rows(observed, key, len(chosen.steps))[:, rows] for key, title in OBSERVED.items()}
    title = f"{chosen.name}: failed seeds that have met the reward"
    publish(curves_figure(chosen.steps.astype(np.float64), panels, xlabel="steps", title=title),
            figures / f"diagnostics-{name}.png")
    one = next((critic for critic in chosen.critics if critic["seed"] in chosen.seeds[rows]), None)
    if one is not None:
        _draw_critic(name, chosen.name, one, figures)


def _leaving(variants: dict[str, Variant]) -> str:
    """Return the line of a title that says when seeds leave."""
    patience = {record["loop"]["patience"] for chosen in variants.values() for record in chosen.records}
    return f"\nA seed leaves when solved in {max(patience)} evaluations in a row, and counts as solved from then on."


def _draw_first_rewards(variants: dict[str, Variant], figures: Path) -> None:
    """Draw when the reward is found first, and how many of these seeds fail."""
    figure, (above, below) = new_panels(2, 1, 7.2, 6.4, share_x=True)
    names = [f"{low + 1}-{high}" for low, high in pairwise(BINS)] + [f"after {BINS[-1]}", "never"]
    for shift, name in enumerate(name for name in (GREEDY, OU) if name in variants):
        chosen = variants[name]
        bins = np.where(chosen.first > 0, np.searchsorted(BINS, chosen.first) - 1, len(names) - 1)
        counts = np.bincount(bins, minlength=len(names))
        failures = np.bincount(bins[chosen.failed], minlength=len(names))
        places = np.arange(len(names)) + 0.4 * shift - 0.2
        above.bar(places, counts / len(bins), width=0.38, color=colour(shift), label=f"{chosen.name} (N = {len(bins)})")
        some = counts > 0
        rates = failures[some] / counts[some]
        pairs = zip(failures[some].tolist(), counts[some].tolist(), strict=True)
        ends = np.transpose([wilson(*pair) for pair in pairs])
        below.errorbar(places[some], rates, np.abs(ends - rates), fmt="o", capsize=3, color=colour(shift))
        for place, height, count in zip(places[some], rates, counts[some], strict=True):
            below.annotate(f"{count}", (place, height), (5, 0), textcoords="offset points", fontsize=7, va="center")
    above.set_ylabel("share of the seeds")
    above.legend(frameon=False, fontsize=9)
    below.set_ylabel("share of these that fail, 95 % Wilson")
    below.set_xlabel("step of the first reward (numbers: seeds)")
    below.set_xticks(range(len(names)), names)
    figure.suptitle("1D-Toy: when the reward is found first, and what becomes of it (Fig. 6.3b)", fontsize=10)
    publish(figure, figures / "first-reward.png")


def _draw_rewarded(variants: dict[str, Variant], figures: Path) -> None:
    """Draw the rewards that failed seeds meet in the mini-batches after an episode."""
    title = f"Rewards among {MINI_BATCHES:,} draws, expected (Fig. 6.3a)"
    failed = {name: chosen for name, chosen in variants.items()
              if name.endswith("epsilon-greedy") and chosen.failed_with_reward.any()}
    panels = {f"failed: {chosen.name}": MINI_BATCHES * joined_rows(chosen.records, "rewarded",
                                                                   len(chosen.steps))[:, chosen.failed_with_reward]
              for chosen in failed.values()}
    for chosen in list(failed.values())[:1]:
        figure = curves_figure(chosen.steps.astype(np.float64), panels, xlabel="steps", title=title)
        for axes in figure.axes:
            axes.axhline(OF_THE_THESIS, color="black", linestyle=":", linewidth=1.2,
                         label=f"[Matheron2020]: {OF_THE_THESIS:g}")
            axes.legend(frameon=False, fontsize=9)
        publish(figure, figures / "rewarded.png")


def _draw_critic(variant: str, name: str, one: dict[str, Any], figures: Path) -> None:
    """Draw a failed seed's critic over states and actions, and along the actions in a few states."""
    states, actions, values, chosen = (np.array(one[key]) for key in ("states", "actions", "values", "chosen"))
    publish(stuck_critic_figure(states, actions, values, chosen, sliced=SLICED_STATES,
                                title=f"{name}, failed seed {one['seed']} (Figs. 6.5 and 6.9b)"),
            figures / f"critic-{variant}.png")
