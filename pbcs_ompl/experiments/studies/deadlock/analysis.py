"""Claims of the deadlock study."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, about, always, at_least, higher, never, rate, sometimes
from pbcs_ompl.experiments.studies.deadlock.drawing import MINI_BATCHES, draw, draw_drift
from pbcs_ompl.experiments.studies.deadlock.variants import (
    ARGMAX,
    EARLY,
    GREEDY,
    OU,
    REGRESSION,
    SAC,
    TD3,
    Variant,
    variants_of,
)

SATURATED = 0.099
VARIANTS = {ARGMAX: "Fig. 6.10(a)", SAC: "Fig. 6.10(b)", REGRESSION: "6.6.3, Eq. 6.5"}
EXPECTED_FAILURES = {GREEDY: (0.01, 0.02), OU: (0.06, 0.03)}
"""What the thesis has, and what counts as near."""
LATEST = 1600
VALLEY = 0.01
"""How far Q(0, a) falls below Q(0, pi(0)) on the way to the reward, where that is called a valley."""
SAME_STEP = 1e-3
"""Values of Q^pi that differ by less belong to one step of it: its levels are powers of the discount."""


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the figures and check the claims."""
    variants = variants_of(records)
    drift = next((record for record in records if record["variant"] == "drift"), None)
    if variants:
        draw(variants, figures)
    if drift is not None:
        draw_drift(drift, figures)
    checks = (_noises, _thesis_rates, _early, _late, _rewards_are_there, _stuck, _piecewise_constant, _valley, _expert,
              _variants, _td3)
    claims = [claim for check in checks for claim in check(variants)]
    return claims if drift is None else [*claims, *_drift(drift)]


def _noises(variants: dict[str, Variant]) -> list[Claim]:
    if not {GREEDY, OU} <= set(variants):
        return []
    return [higher("Ornstein-Uhlenbeck noise fails more often than epsilon-greedy noise", variants[OU].failures,
                   variants[GREEDY].failures, ("failures, Ornstein-Uhlenbeck", "failures, epsilon-greedy"),
                   "[Matheron2020] Fig. 6.2(a)", expected=(EXPECTED_FAILURES[OU][0], EXPECTED_FAILURES[GREEDY][0]))]


def _thesis_rates(variants: dict[str, Variant]) -> list[Claim]:
    return [about(f"{variants[name].name}: about {share:.0%} of the seeds fail", "failures", variants[name].failures,
                  share, near, "[Matheron2020] Fig. 6.2(a)")
            .with_note("settings of the networks and of the noise that the thesis does not give are ours")
            for name, (share, near) in EXPECTED_FAILURES.items() if name in variants]


def _early(variants: dict[str, Variant]) -> list[Claim]:
    if GREEDY not in variants:
        return []
    greedy, source = variants[GREEDY], "[Matheron2020] 6.3, Fig. 6.3(b)"
    late, latest = ~greedy.early, (greedy.first > LATEST) | (greedy.first < 0)
    return [always(f"success is certain when the reward is found in the first {EARLY} steps", "solved",
                   greedy.solved_of(greedy.early), source),
            about(f"the reward is found in the first {EARLY} steps by 63 % of the seeds", "found",
                  rate(greedy.early.sum(), len(greedy.first)), 0.63, 0.1, source),
            about(f"found after more than {EARLY} steps, success drops to 96 %", "solved", greedy.solved_of(late), 0.96,
                  0.05, source),
            about(f"not found in the first {LATEST} steps, it drops to 87 %", "solved", greedy.solved_of(latest), 0.87,
                  0.1, source)]


def _late(variants: dict[str, Variant]) -> list[Claim]:
    return [higher(f"{chosen.name}: solved more often when the reward is found in the first {EARLY} steps",
                   chosen.solved_of(chosen.early), chosen.solved_of(~chosen.early),
                   ("solved, found early", "solved, found late or never"), "[Matheron2020] Fig. 6.3(b)")
            for name, chosen in variants.items() if name in (GREEDY, OU)]


def _rewards_are_there(variants: dict[str, Variant]) -> list[Claim]:
    failed = [chosen.rewarded[chosen.failed_with_reward] for name, chosen in variants.items()
              if name.endswith("epsilon-greedy")]
    share = np.concatenate([np.empty(0), *failed])
    mean = float(MINI_BATCHES * share.mean()) if len(share) else None
    return [always("with epsilon-greedy noise, at least 0.1 % of what failed seeds learn from is rewarded",
                   "at least 0.1 %", rate((share >= 1e-3).sum(), len(share)), "[Matheron2020] Fig. 6.3(a)")
            .with_numbers(**{f"rewards in {MINI_BATCHES:,} draws, mean ([Matheron2020]: 6.03)": mean,
                             "shares": share.round(5).tolist()})]


def _stuck(variants: dict[str, Variant]) -> list[Claim]:
    failed = [chosen for name, chosen in variants.items() if name.startswith((GREEDY, OU))]
    parts = {name: np.concatenate([np.empty(0), *(chosen.observed(name)[chosen.failed_with_reward]
                                                  for chosen in failed)])
             for name in ("saturation", "deadlock_index", "distance_to_returns", "mean_action")}

    def share(holds: np.ndarray) -> dict[str, Any]:
        return rate(holds.sum(), len(holds))

    return [always("DDPG's failed seeds that have met the reward have a saturated actor (over 90 % of the actions)",
                   "saturated", share(parts["saturation"] > 0.9), "[Matheron2020] 6.2.2"),
            always("it goes to the right everywhere (mean action above 0.09)", "to the right",
                   share(parts["mean_action"] > 0.09), "[Matheron2020] 6.2.2"),
            at_least("most have a critic that knows better actions but shows no way to them (deadlock index > 0)",
                     "stuck", share(parts["deadlock_index"] > 0.0), 0.5, "[Matheron2020] 6.3.2, Theorems 1 and 2")
            .with_numbers(indices=parts["deadlock_index"].round(3).tolist()),
            at_least("most have a critic that is Q^pi (mean |Q - Q^pi| below 0.1, the reward being 1)", "below 0.1",
                     share(parts["distance_to_returns"] < 0.1), 0.5, "[Matheron2020] 6.4.1")
            .with_numbers(means=parts["distance_to_returns"].round(3).tolist())]


def _critics(variants: dict[str, Variant]) -> list[dict[str, Any]]:
    """Return the mapped critics of DDPG's failed seeds that have met the reward."""
    return [critic for name, chosen in variants.items() if name.startswith((GREEDY, OU))
            for critic in chosen.critics if critic["seed"] in chosen.seeds[chosen.failed_with_reward]]


def _piecewise_constant(variants: dict[str, Variant]) -> list[Claim]:
    """Theorem 3, on the grid of states and actions: Q^pi changes from a point to its neighbour only at its steps."""
    same, pairs, levels = 0, 0, []
    for critic in _critics(variants):
        returns = np.array(critic["returns"])
        for axis in (0, 1):
            steps = np.abs(np.diff(returns, axis=axis))
            same, pairs = same + int((steps < SAME_STEP).sum()), pairs + steps.size
        levels.append(len(np.unique(returns.round(3))))
    return [at_least("Q^pi is piecewise constant: neighbours on the grid have the same value", "same",
                     rate(same, pairs), 0.95, "[Matheron2020] Theorem 3").with_numbers(different_values=levels)]


def _valley(variants: dict[str, Variant]) -> list[Claim]:
    """Whether Q(0, a) falls on the way from the actor's action to the left before it rises."""
    depths = []
    for critic in _critics(variants):
        actions, values = np.array(critic["actions"]), np.array(critic["values"])[0]
        if critic["chosen"][0] > 0.0:
            here = float(np.interp(critic["chosen"][0], actions, values))
            way = values[(actions >= 0.0) & (actions <= critic["chosen"][0])]
            depths.append(here - float(way.min(initial=here)))
    deep = np.array(depths) > VALLEY
    return [at_least(f"most critics of failed seeds have a valley (deeper than {VALLEY:g}) between the actor's action "
                     "in s = 0 and the reward", "with a valley", rate(deep.sum(), len(deep)), 0.5,
                     "[Matheron2020] 6.5, Fig. 6.9(b)").with_numbers(depths=np.round(depths, 4).tolist())]


def _expert(variants: dict[str, Variant]) -> list[Claim]:
    counts = np.zeros((2, 2), dtype=int)
    for chosen in variants.values():
        if chosen.expert_after is not None and chosen.expert_after < chosen.steps[-1]:
            unsolved = ~chosen.success[int(np.searchsorted(chosen.steps, chosen.expert_after))]
            aware = (chosen.first > 0) & (chosen.first <= chosen.expert_after)
            counts += [[int((unsolved & who & left).sum()) for left in (chosen.failed, ~chosen.failed)]
                       for who in (aware, ~aware)]
    return [at_least("most seeds that are unsolved when the behaviour becomes optimal remain so, though every episode "
                     "meets the reward from then on", "remain unsolved", rate(counts[:, 0].sum(), counts.sum()), 0.5,
                     "[Matheron2020] Fig. 6.2(b)")
            .with_numbers(of_those_that_had_met_the_reward_before=rate(counts[0, 0], counts[0].sum()),
                          of_the_others=rate(counts[1, 0], counts[1].sum()))]


def _variants(variants: dict[str, Variant]) -> list[Claim]:
    return [never(f"{variants[name].name} reaches 100 %", "failures", variants[name].failures,
                  f"[Matheron2020] {source}")
            .with_numbers(steps_until_most_are_solved=variants[name].half)
            for name, source in VARIANTS.items() if name in variants]


def _td3(variants: dict[str, Variant]) -> list[Claim]:
    if TD3 not in variants:
        return []
    td3 = variants[TD3]
    met = rate(td3.failed_with_reward.sum(), (td3.first > 0).sum())
    return [sometimes("TD3 fails like DDPG: some of its seeds that have met the reward are not solved",
                      "failures, having met the reward", met, "[Matheron2020] 6.4")
            .with_numbers(failures=td3.failures)]


def _drift(record: dict[str, Any]) -> list[Claim]:
    actions, updates = np.array(record["largest_action"]), np.array(record["updates"])
    values, right = np.array(record["largest_value"]), np.array(record["mean_action"])[-1] > 0.0
    saturated, seeds = actions >= SATURATED, actions.shape[1]
    when = updates[saturated.argmax(axis=0)[saturated.any(axis=0)]]
    grown = rate((values.max(axis=0) > values[0]).sum(), seeds)
    return [always("without any reward, every actor drifts to the end of the action box", "saturated at some time",
                   rate(saturated.any(axis=0).sum(), seeds), "[Matheron2020] Fig. 6.4(b)")
            .with_numbers(updates_until_then_median=float(np.median(when)) if len(when) else None,
                          saturated_at_the_end=rate(saturated[-1].sum(), seeds)),
            about("half of the actors drift to the right", "to the right", rate(right.sum(), seeds), 0.5, 0.15,
                  "[Matheron2020] 6.5"),
            sometimes("max |Q| can increase without any reward", "higher than at first, at some time", grown,
                      "[Matheron2020] Fig. 6.4(a)")
            .with_numbers(largest_value_median={"at first": float(np.median(values[0])),
                                                "at most": float(np.median(values.max(axis=0))),
                                                "at the end": float(np.median(values[-1]))})]
