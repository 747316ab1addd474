"""Figures and claims of the deadlock study."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.figures.diagnostics import curves_figure, slices_figure, success_figure
from pbcs_ompl.studies import Claim, rate
from pbcs_ompl.studies.joined import joined_first_rewards, joined_observed, joined_success

EARLY = 50
SATURATED = 0.099
GREEDY, OU = "ddpg-epsilon-greedy", "ddpg-ornstein-uhlenbeck"
CURES = {"ddpg-argmax-epsilon-greedy": ("DDPG-argmax", "a"), "sac-epsilon-greedy": ("SAC", "b")}


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
    def failures(self) -> dict[str, Any]:
        """The rate of failure."""
        return rate(self.failed.sum(), len(self.failed))


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the figures and check the claims."""
    names = dict.fromkeys(record["variant"] for record in records if record["variant"] != "drift")
    variants = {name: Variant([record for record in records if record["variant"] == name]) for name in names}
    drift = next((record for record in records if record["variant"] == "drift"), None)
    _draw(variants, drift, figures)
    checks = (_noises, _thesis_rates, _early, _late, _rewards_are_there, _stuck, _expert, _cures)
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
            told = chosen.failed.any() and early["n"] and late["n"]
            claims.append(Claim(f"{name} is less often solved when the reward is found after the first {EARLY} steps",
                                bool(late["rate"] < early["rate"]) if told else None,
                                {"solved, found early": early, "solved, found late or never": late},
                                "[Matheron2020] Fig. 6.3(b)", "" if told else "no seed failed"))
    return claims


def _failed_with_reward(variants: dict[str, Variant]) -> dict[str, tuple[Variant, np.ndarray]]:
    """Return the failed seeds that have met the reward, of the variants without an expert."""
    return {name: (chosen, chosen.failed & (chosen.first > 0)) for name, chosen in variants.items()
            if chosen.expert_after is None and (chosen.failed & (chosen.first > 0)).any()}


def _rewards_are_there(variants: dict[str, Variant]) -> list[Claim]:
    shares = [chosen.rewarded[failed] for name, (chosen, failed) in _failed_with_reward(variants).items()
              if name.endswith("epsilon-greedy")]
    share = np.concatenate([np.empty(0), *shares])
    return [Claim("with epsilon-greedy noise, failed seeds have at least 0.1 % of rewarded transitions in mini-batches",
                  bool(share.min() >= 1e-3) if len(share) else None,
                  {"failed seeds": len(share), "shares": share.round(5).tolist()}, "[Matheron2020] Fig. 6.3(a)",
                  "" if len(share) else "no such seed failed")]


def _stuck(variants: dict[str, Variant]) -> list[Claim]:
    failed = _failed_with_reward(variants).values()
    parts = {name: np.concatenate([np.empty(0), *(chosen.observed(name)[rows] for chosen, rows in failed)])
             for name in ("saturation", "deadlock_index")}
    saturated, stuck = parts["saturation"] > 0.9, parts["deadlock_index"] > 0.0
    told = len(saturated) > 0
    note = "" if told else "no seed failed after it had met the reward"
    return [Claim("failed seeds that have met the reward have a saturated actor (over 90 % of the actions)",
                  bool(saturated.all()) if told else None, {"saturated": rate(saturated.sum(), len(saturated))},
                  "[Matheron2020] 6.2.2", note),
            Claim("and a critic that knows better actions but shows no way to them (deadlock index > 0)",
                  bool(stuck.all()) if told else None,
                  {"stuck": rate(stuck.sum(), len(stuck)), "indices": parts["deadlock_index"].round(3).tolist()},
                  "[Matheron2020] 6.3.2, Theorems 1 and 2", note)]


def _expert(variants: dict[str, Variant]) -> list[Claim]:
    stuck = saved = unaware = woken = 0
    for chosen in variants.values():
        if chosen.expert_after is not None and chosen.expert_after < chosen.steps[-1]:
            row = int(np.searchsorted(chosen.steps, chosen.expert_after))
            unsolved, aware = ~chosen.success[row], (chosen.first > 0) & (chosen.first <= chosen.expert_after)
            before, never = unsolved & aware, unsolved & ~aware
            stuck, saved = stuck + int(before.sum()), saved + int((before & ~chosen.failed).sum())
            unaware, woken = unaware + int(never.sum()), woken + int((never & ~chosen.failed).sum())
    remain = rate(stuck - saved, stuck)
    return [Claim("most seeds that are stuck, having met the reward, when the behaviour becomes optimal remain stuck",
                  remain["rate"] > 0.5 if stuck else None,
                  {"remain stuck, having met the reward before": remain,
                   "solved, of those that had never met it": rate(woken, unaware)}, "[Matheron2020] Fig. 6.2(b)",
                  "" if stuck else "no seed was stuck then that had met the reward")]


def _cures(variants: dict[str, Variant]) -> list[Claim]:
    return [Claim(f"{name} reaches 100 %", variants[variant].failures["successes"] == 0,
                  {"failures": variants[variant].failures}, f"[Matheron2020] Fig. 6.10({letter})")
            for variant, (name, letter) in CURES.items() if variant in variants]


def _drift(record: dict[str, Any]) -> list[Claim]:
    actions, updates = np.array(record["largest_action"]), np.array(record["updates"])
    saturated = actions >= SATURATED
    when = updates[saturated.argmax(axis=0)[saturated.any(axis=0)]]
    ever = rate(saturated.any(axis=0).sum(), saturated.shape[1])
    return [Claim("without any reward, every actor drifts to the end of the action box", ever["rate"] == 1.0,
                  {"saturated at some time": ever, "updates until then, median": float(np.median(when)) if len(when)
                   else None, "saturated at the end": rate(saturated[-1].sum(), saturated.shape[1])},
                  "[Matheron2020] Fig. 6.4(b)")]


def _draw(variants: dict[str, Variant], drift: dict[str, Any] | None, figures: Path) -> None:
    curves = {name: (chosen.steps, chosen.success) for name, chosen in variants.items()}
    plain = {name: curve for name, curve in curves.items() if variants[name].expert_after is None}
    save(success_figure(plain, title="1D-Toy: noises and algorithms (Figs. 6.2a, 6.10)"), figures / "success.png")
    if len(plain) < len(curves):
        save(success_figure(curves, title="1D-Toy: the optimal behaviour from the middle on (Fig. 6.2b)"),
             figures / "expert.png")
    _draw_first_rewards(variants, figures)
    if drift is not None:
        panels = {"max |Q|": np.array(drift["largest_value"]), "max |π|": np.array(drift["largest_action"])}
        save(curves_figure(np.array(drift["updates"]), panels, title="Drift: no reward at all (Fig. 6.4)"),
             figures / "drift.png")
    for name, (chosen, failed) in _failed_with_reward(variants).items():
        seeds = np.concatenate([record["seeds"] for record in chosen.records])[failed]
        one = next((part for record in chosen.records for part in record["slices"] if part["seed"] in seeds), None)
        if one is not None:
            _draw_slices(name, one, figures)


def _draw_first_rewards(variants: dict[str, Variant], figures: Path) -> None:
    figure, axes = new_figure(7.2, 4.6)
    for name, chosen in variants.items():
        if chosen.expert_after is None:
            first = np.sort(np.where(chosen.first > 0, chosen.first, chosen.steps[-1]))
            (line,) = axes.step(first, np.arange(1, len(first) + 1) / len(first), where="post",
                                label=f"{name} (N = {len(first)})")
            late = np.where(chosen.first > 0, chosen.first, chosen.steps[-1])[chosen.failed]
            axes.plot(late, np.zeros(len(late)), "x", color=line.get_color(), markersize=8)
    axes.set_xscale("log")
    axes.set_xlabel("step of the first reward (crosses: of the seeds that fail)")
    axes.set_ylabel("share of the seeds")
    axes.set_title("1D-Toy: when the reward is found first (Fig. 6.3b)", fontsize=10)
    axes.legend(frameon=False, fontsize=9)
    save(figure, figures / "first-reward.png")


def _draw_slices(name: str, one: dict[str, Any], figures: Path) -> None:
    labels = [f"s = {state:g}" for state in (0.0, 0.05, 0.1, 0.3)]
    slices = {label: np.array(values) for label, values in zip(labels, one["values"], strict=True)}
    chosen = dict(zip(labels, one["chosen"], strict=True))
    title = f"{name}, failed seed {one['seed']}: Q along the actions (Fig. 6.5b)"
    save(slices_figure(np.array(one["actions"]), slices, chosen, title=title), figures / f"critic-{name}.png")
    ends = [np.interp(chosen[label], one["actions"], slices[label]) for label in labels]
    span = max(1e-3, 0.1 * float(np.ptp(np.array(one["values"]))))
    limits = (min(ends) - span, max(ends) + span)
    save(slices_figure(np.array(one["actions"]), slices, chosen, title=f"{title}, enlarged (Fig. 6.9b)", ylim=limits),
         figures / f"critic-{name}-enlarged.png")
