"""Is it exploration that DDPG lacks, or the actor update? Sparse HalfCheetah with priming, [Matheron2020] 6.7.

Priming: in one episode of `primed_every` a good policy acts in place of the actor, so that the replay buffer always
holds what is needed to learn. `pretrain.py` made that policy, expert.npz.
"""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.agents import Policy
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_arrays

EXPERT = "expert.npz"


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each variant of each seed; a sweep that is cut short has whole seeds."""
    common = {key: sweep[key] for key in ("episodes", "primed_every", "noise")}
    return [{"name": f"{variant}-{seed}", "variant": variant, "seed": seed, **common, **options,
             "agent_settings": sweep["agent"], "expert": str(Path(__file__).with_name(EXPERT))}
            for seed in range(seeds) for variant, options in sweep["variants"].items()]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train one agent; return the return of every episode, and of one without noise after the last."""
    model, kind = make("pbcs/SparseHalfCheetah-v0", {"threads": 1}), load("agent", settings["agent"])
    agent = kind(model.observation_size, model.action_low, model.action_high, seeds=(settings["seed"],),
                 settings=kind.settings_type(**settings["agent_settings"]))
    expert = Policy.from_arrays(read_arrays(Path(settings["expert"])))
    rng = SeedTree(settings["seed"]).child("behaviour").generator()
    returns, primed = [], []
    with one_thread():
        for episode in range(settings["episodes"]):
            primed.append(settings["primed"] and episode % settings["primed_every"] == 0)
            actor = expert if primed[-1] else agent.policy()
            returns.append(_episode(model, actor, settings["seed"] + episode, settings["noise"], rng, agent))
            agent.train(model.max_episode_steps)
    final = _episode(model, agent.policy(), settings["seed"], 0.0, rng, None)
    return {"variant": settings["variant"], "seed": settings["seed"], "best": 2.0 * model.max_episode_steps,
            "returns": returns, "primed": primed, "final": final}


def _episode(model: ResettableModel, actor: Policy, start: int, noise: float, rng: np.random.Generator,
             agent: StackedAgent | None) -> float:
    """Run an episode from `reset(seed=start)`, which `agent` stores, and return its return."""
    low, high = model.action_low, model.action_high
    state = model.initial_state(start)[None]
    parts: list[tuple[Array, ...]] = []
    terminals: list[BoolArray] = []
    for _ in range(model.max_episode_steps):
        observation = model.observe(state)
        wobble = noise * rng.uniform(-1.0, 1.0, low.shape) * (high - low) / 2.0
        action = np.clip(actor.act(observation) + wobble, low, high)
        outcome = model.transition(state, action)
        parts.append((observation, action, outcome.rewards, model.observe(outcome.states)))
        terminals.append(outcome.terminated)
        state = outcome.states
    observations, actions, rewards, following = (np.stack(part, axis=1) for part in zip(*parts, strict=True))
    if agent is not None:
        agent.add_transitions(observations, actions, rewards, following, np.stack(terminals, axis=1))
    return float(rewards.sum())
