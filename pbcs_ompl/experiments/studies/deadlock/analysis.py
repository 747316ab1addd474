"""Figures and claims of the deadlock study."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.claims import Claim, rate
from pbcs_ompl.experiments.stacked_training import joined_first_rewards, joined_observed, joined_rows, joined_success
from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.figures.diagnostics import critic_map_figure, curves_figure, slices_figure, success_figure

EARLY = 50
SATURATED = 0.099
GREEDY, OU = "ddpg-epsilon-greedy", "ddpg-ornstein-uhlenbeck"
VARIANTS = {"ddpg-argmax-epsilon-greedy": ("DDPG-argmax", "Fig. 6.10(a)"),
            "sac-epsilon-greedy": ("SAC", "Fig. 6.10(b)"),
            "ddpg-regression-epsilon-greedy": ("DDPG with the actor's update by regression", "6.6.3, Eq. 6.5")}
TD3 = "td3-epsilon-greedy"
OBSERVED = {"saturation": "saturated actions", "flat_share": "flat share", "deadlock_index": "deadlock index",
            "distance_to_returns": "mean |Q - Q^π|"}
SLICED_STATES = (0.0, 0.05, 0.1, 0.3)
BINS = (0, 50, 100, 200, 400, 800, 1600)
"""Steps of the first reward that are distinguished, as powers of two of the longest episode."""
MINI_BATCHES = 50 * 100
"""Transitions that are drawn after an episode without the reward: 50 mini-batches of 100."""


class Variant:
    """All seeds of one variant: when they were solved, and when they first met the reward."""

    def __init__(self, records: list[dict[str, Any]]):
        loop = records[0]["loop"]
        self.records, self.expert_after = records, records[0]["expert_after"]
        self.steps, self.success = joined_success(records, loop["steps"], loop["evaluate_every"])
        self.first = joined_first_rewards(records)
        self.failed = ~self.success[-1]
        self.rewarded = np.concatenate([np.array(record["rewarded"][-1]) for record in records])
        self.early = (self.first > 0) & (self.first <= EARLY)

    def observed(self, name: str) -> np.ndarray:
        """Return what an observer said at the end [S]."""
        return joined_observed(self.records, name)

    @property
    def half(self) -> int | None:
        """The first evaluation at which more than half of the seeds were solved."""
        rows = np.flatnonzero(self.success.mean(axis=1) > 0.5)
        return int(self.steps[rows[0]]) if len(rows) else None

    @property
    def failures(self) -> dict[str, Any]:
        """The rate of failure."""
        return rate(self.failed.sum(), len(self.failed))


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the figures and check the claims."""
    names = dict.fromkeys(record["variant"] for record in records if record["variant"] != "drift")
    variants = {name: Variant([record for record in records if record["variant"] == name]) for name in names}
    drift = next((record for record in records if record["variant"] == "drift"), None)
    if variants:
        _draw(variants, figures)
    if drift is not None:
        _draw_drift(drift, figures)
    checks = (_noises, _thesis_rates, _early, _late, _rewards_are_there, _stuck, _expert, _variants, _td3)
    claims = [claim for check in checks for claim in check(variants)]
    return claims if drift is None else [*claims, *_drift(drift)]


def _noises(variants: dict[str, Variant]) -> list[Claim]:
    if not {GREEDY, OU} <= set(variants):
        return []
    greedy, ou = variants[GREEDY].failures, variants[OU].failures
    return [Claim("Ornstein-Uhlenbeck noise fails more often than epsilon-greedy noise", ou["rate"] > greedy["rate"],
                  {"failures, Ornstein-Uhlenbeck": ou, "failures, epsilon-greedy": greedy,
                   "the intervals lie apart": ou["wilson"][0] > greedy["wilson"][1]}, "[Matheron2020] Fig. 6.2(a)")]


def _thesis_rates(variants: dict[str, Variant]) -> list[Claim]:
    expected = {GREEDY: 0.01, OU: 0.06}
    return [Claim(f"{name} fails on about {share:.0%} of the seeds (that lies in the interval)",
                  variants[name].failures["wilson"][0] <= share <= variants[name].failures["wilson"][1],
                  {"failures": variants[name].failures}, "[Matheron2020] Fig. 6.2(a)",
                  "settings of the networks and of the noise that the thesis does not give are ours")
            for name, share in expected.items() if name in variants]


def _early(variants: dict[str, Variant]) -> list[Claim]:
    if GREEDY not in variants:
        return []
    greedy = variants[GREEDY]
    found = rate(greedy.early.sum(), len(greedy.first))
    solved = rate((greedy.early & ~greedy.failed).sum(), greedy.early.sum())
    low, high = found["wilson"]
    return [Claim(f"success is certain when the reward is found in the first {EARLY} steps",
                  solved["rate"] == 1.0 if solved["n"] else None, {"solved": solved}, "[Matheron2020] Fig. 6.3(b)"),
            Claim(f"the reward is found in the first {EARLY} steps by 63 % of the seeds (that lies in the interval)",
                  low <= 0.63 <= high, {"found": found}, "[Matheron2020] Fig. 6.3(b)")]


def _late(variants: dict[str, Variant]) -> list[Claim]:
    claims = []
    for name in (GREEDY, OU):
        if name in variants:
            chosen = variants[name]
            early = rate((chosen.early & ~chosen.failed).sum(), chosen.early.sum())
            late = rate((~chosen.early & ~chosen.failed).sum(), (~chosen.early).sum())
            decided = chosen.failed.any() and early["n"] and late["n"]
            claims.append(Claim(f"{name} is less often solved when the reward is found after the first {EARLY} steps",
                                bool(late["rate"] < early["rate"]) if decided else None,
                                {"solved, found early": early, "solved, found late or never": late},
                                "[Matheron2020] Fig. 6.3(b)", "" if decided else "no seed failed"))
    return claims


def _failed_with_reward(variants: dict[str, Variant]) -> dict[str, tuple[Variant, np.ndarray]]:
    """Return the failed seeds that have met the reward, by themselves or with the expert."""
    return {name: (chosen, chosen.failed & (chosen.first > 0)) for name, chosen in variants.items()
            if (chosen.failed & (chosen.first > 0)).any()}


def _rewards_are_there(variants: dict[str, Variant]) -> list[Claim]:
    shares = [chosen.rewarded[failed] for name, (chosen, failed) in _failed_with_reward(variants).items()
              if name.endswith("epsilon-greedy")]
    share = np.concatenate([np.empty(0), *shares])
    return [Claim("with epsilon-greedy noise, failed seeds have at least 0.1 % of rewarded transitions in mini-batches",
                  bool(share.min() >= 1e-3) if len(share) else None,
                  {"failed seeds": len(share), "shares": share.round(5).tolist()}, "[Matheron2020] Fig. 6.3(a)",
                  "" if len(share) else "no such seed failed")]


def _stuck(variants: dict[str, Variant]) -> list[Claim]:
    failed = [part for name, part in _failed_with_reward(variants).items() if name.startswith((GREEDY, OU))]
    parts = {name: np.concatenate([np.empty(0), *(chosen.observed(name)[rows] for chosen, rows in failed)])
             for name in ("saturation", "deadlock_index", "distance_to_returns")}
    saturated, stuck, come = (parts["saturation"] > 0.9, parts["deadlock_index"] > 0.0,
                              parts["distance_to_returns"] < 0.1)
    decided = len(saturated) > 0
    note = "" if decided else "no seed failed after it had met the reward"
    return [Claim("DDPG's failed seeds that have met the reward have a saturated actor (over 90 % of the actions)",
                  bool(saturated.all()) if decided else None, {"saturated": rate(saturated.sum(), len(saturated))},
                  "[Matheron2020] 6.2.2", note),
            Claim("and a critic that knows better actions but shows no way to them (deadlock index > 0)",
                  bool(stuck.all()) if decided else None,
                  {"stuck": rate(stuck.sum(), len(stuck)), "indices": parts["deadlock_index"].round(3).tolist()},
                  "[Matheron2020] 6.3.2, Theorems 1 and 2", note),
            Claim("a critic that is Q^pi, what their actor earns (mean |Q - Q^pi| below 0.1, the reward being 1)",
                  bool(come.all()) if decided else None,
                  {"below 0.1": rate(come.sum(), len(come)), "means": parts["distance_to_returns"].round(3).tolist()},
                  "[Matheron2020] 6.4.1", note)]


def _expert(variants: dict[str, Variant]) -> list[Claim]:
    counts = np.zeros((2, 2), dtype=int)
    for chosen in variants.values():
        if chosen.expert_after is not None and chosen.expert_after < chosen.steps[-1]:
            unsolved = ~chosen.success[int(np.searchsorted(chosen.steps, chosen.expert_after))]
            aware = (chosen.first > 0) & (chosen.first <= chosen.expert_after)
            counts += [[(unsolved & who & what).sum() for what in (chosen.failed, ~chosen.failed)]
                       for who in (aware, ~aware)]
    remain = rate(counts[:, 0].sum(), counts.sum())
    return [Claim("most seeds that are unsolved when the behaviour becomes optimal remain so, though every episode "
                  "meets the reward from then on", remain["rate"] > 0.5 if remain["n"] else None,
                  {"remain unsolved": remain,
                   "of those that had met the reward before": rate(counts[0, 0], counts[0].sum()),
                   "of the others": rate(counts[1, 0], counts[1].sum())}, "[Matheron2020] Fig. 6.2(b)",
                  "" if remain["n"] else "no seed was unsolved then")]


def _variants(variants: dict[str, Variant]) -> list[Claim]:
    return [Claim(f"{name} reaches 100 %", variants[variant].failures["successes"] == 0,
                  {"failures": variants[variant].failures, "steps until most are solved": variants[variant].half},
                  f"[Matheron2020] {source}")
            for variant, (name, source) in VARIANTS.items() if variant in variants]


def _td3(variants: dict[str, Variant]) -> list[Claim]:
    if TD3 not in variants:
        return []
    td3 = variants[TD3]
    met = rate((td3.failed & (td3.first > 0)).sum(), (td3.first > 0).sum())
    return [Claim("TD3 fails like DDPG: some of its seeds that have met the reward are not solved",
                  met["successes"] > 0, {"failures": td3.failures, "failures, having met the reward": met},
                  "[Matheron2020] 6.4")]


def _drift(record: dict[str, Any]) -> list[Claim]:
    actions, updates = np.array(record["largest_action"]), np.array(record["updates"])
    saturated = actions >= SATURATED
    when = updates[saturated.argmax(axis=0)[saturated.any(axis=0)]]
    ever = rate(saturated.any(axis=0).sum(), saturated.shape[1])
    return [Claim("without any reward, every actor drifts to the end of the action box", ever["rate"] == 1.0,
                  {"saturated at some time": ever, "updates until then, median": float(np.median(when)) if len(when)
                   else None, "saturated at the end": rate(saturated[-1].sum(), saturated.shape[1])},
                  "[Matheron2020] Fig. 6.4(b)")]


def _draw_drift(drift: dict[str, Any], figures: Path) -> None:
    panels = {"max |Q|": np.array(drift["largest_value"]), "max |π|": np.array(drift["largest_action"])}
    updates = np.array(drift["updates"], dtype=np.float64)
    save(curves_figure(updates, panels, title="Drift: no reward at all (Fig. 6.4)"), figures / "drift.png")


def _draw(variants: dict[str, Variant], figures: Path) -> None:
    curves = {name: (chosen.steps, chosen.success) for name, chosen in variants.items()}
    plain = {name: curve for name, curve in curves.items() if variants[name].expert_after is None}
    pairs = {name: curve for name, curve in curves.items() if f"{name}-expert" in curves or name not in plain}
    leaving = _leaving(variants)
    save(success_figure(plain, title=f"1D-Toy: noises and algorithms (Figs. 6.2a, 6.10){leaving}"),
         figures / "success.png")
    if len(plain) < len(curves):
        after = min({chosen.expert_after for chosen in variants.values()} - {None})
        save(success_figure(pairs, title=f"1D-Toy: optimal behaviour from step {after:,} on (Fig. 6.2b){leaving}"),
             figures / "expert.png")
    _draw_first_rewards(variants, figures)
    _draw_rewarded(variants, figures)
    for name, (chosen, failed) in _failed_with_reward(variants).items():
        observed = [record["observed"] for record in chosen.records]
        panels = {title: joined_rows(observed, key, len(chosen.steps))[:, failed] for key, title in OBSERVED.items()}
        title = f"{name}: failed seeds that have met the reward"
        save(curves_figure(chosen.steps.astype(np.float64), panels, xlabel="steps", title=title),
             figures / f"diagnostics-{name}.png")
        seeds = np.concatenate([record["seeds"] for record in chosen.records])[failed]
        one = next((part for record in chosen.records for part in record["critics"] if part["seed"] in seeds), None)
        if one is not None:
            _draw_critic(name, one, figures)


def _leaving(variants: dict[str, Variant]) -> str:
    """Return the line of a title that says when seeds leave."""
    patience = {record["loop"]["patience"] for chosen in variants.values() for record in chosen.records}
    return f"\nA seed leaves when solved in {max(patience)} evaluations in a row, and counts as solved from then on."


def _draw_first_rewards(variants: dict[str, Variant], figures: Path) -> None:
    """Draw when the reward is found first, and how many of these seeds fail."""
    figure, axes = new_figure(7.2, 6.4)
    axes.remove()
    above, below = figure.subplots(2, 1, sharex=True)
    names = [f"{low + 1}-{high}" for low, high in pairwise(BINS)] + [f"after {BINS[-1]}", "never"]
    for shift, name in enumerate(name for name in (GREEDY, OU) if name in variants):
        chosen = variants[name]
        bins = np.where(chosen.first > 0, np.searchsorted(BINS, chosen.first) - 1, len(names) - 1)
        counts = np.bincount(bins, minlength=len(names))
        failures = np.bincount(bins[chosen.failed], minlength=len(names))
        places = np.arange(len(names)) + 0.4 * shift - 0.2
        above.bar(places, counts / len(bins), width=0.38, label=f"{name} (N = {len(bins)})")
        some = counts > 0
        rates = failures[some] / counts[some]
        pairs = zip(failures[some].tolist(), counts[some].tolist(), strict=True)
        ends = np.transpose([wilson(*pair) for pair in pairs])
        below.errorbar(places[some], rates, np.abs(ends - rates), fmt="o", capsize=3)
    above.set_ylabel("share of the seeds")
    above.legend(frameon=False, fontsize=9)
    below.set_ylabel("share of these that fail, 95 % Wilson")
    below.set_xlabel("step of the first reward")
    below.set_xticks(range(len(names)), names)
    figure.suptitle("1D-Toy: when the reward is found first, and what becomes of it (Fig. 6.3b)", fontsize=10)
    save(figure, figures / "first-reward.png")


def _draw_rewarded(variants: dict[str, Variant], figures: Path) -> None:
    """Draw the rewards that failed seeds meet in the mini-batches after an episode."""
    title = f"Rewards among {MINI_BATCHES:,} draws, expected (Fig. 6.3a)"
    failed = {name: part for name, part in _failed_with_reward(variants).items() if name.endswith("epsilon-greedy")}
    panels = {f"failed, {name}": MINI_BATCHES * joined_rows(chosen.records, "rewarded", len(chosen.steps))[:, rows]
              for name, (chosen, rows) in failed.items()}
    for chosen, _ in list(failed.values())[:1]:
        save(curves_figure(chosen.steps.astype(np.float64), panels, xlabel="steps", title=title),
             figures / "rewarded.png")


def _draw_critic(name: str, one: dict[str, Any], figures: Path) -> None:
    """Draw a failed seed's critic over states and actions, and along the actions in a few states."""
    states, actions, values = np.array(one["states"]), np.array(one["actions"]), np.array(one["values"])
    title = f"{name}, failed seed {one['seed']}"
    save(critic_map_figure(states, actions, values, np.array(one["chosen"]), title=f"{title}: Q(s, a) (Fig. 6.5a)"),
         figures / f"critic-{name}-map.png")
    rows = {f"s = {state:g}": int(np.abs(states - state).argmin()) for state in SLICED_STATES}
    slices = {label: values[row] for label, row in rows.items()}
    chosen = {label: one["chosen"][row] for label, row in rows.items()}
    title = f"{title}: Q(s, .)"
    save(slices_figure(actions, slices, chosen, title=f"{title} (Fig. 6.5b)"), figures / f"critic-{name}.png")
    ends = [float(np.interp(chosen[label], actions, slices[label])) for label in rows]
    span = max(1e-3, 0.02 * float(np.ptp(values)))
    save(slices_figure(actions, slices, chosen, title=f"{title}, enlarged (Fig. 6.9b)",
                       ylim=(min(ends) - span, max(ends) + span)), figures / f"critic-{name}-enlarged.png")
