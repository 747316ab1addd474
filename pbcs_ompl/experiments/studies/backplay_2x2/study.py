"""Backplay along a plan and DDPG without one, in the smallest maze: [Matheron2020] Figs. 5.2, 5.4 and 7.1."""

from typing import Any

import numpy as np

from pbcs_ompl.agents import DDPG, DDPGSettings, EpsilonGreedy
from pbcs_ompl.experiments.stacked_training import LoopSettings, StackedTraining
from pbcs_ompl.experiments.training_run import trained
from pbcs_ompl.resettable import make

MAZE = {"size": 2}
EPISODE = 50
BINS = 80
"""Cells of the map of visits along each axis."""
FROZEN = 1e-12
"""The learning rate of an actor that must not change."""
TAUGHT, CORRECTED, EVERY = 2_000, 30_000, 100
"""Updates that teach a value that is too high, the most that correct it, and how often it is looked at."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each training; of all seeds together, one of DDPG alone, and one of critics for each discount."""
    chosen = range(sweep["first_seed"], sweep["first_seed"] + seeds)
    common = {key: sweep[key] for key in ("preset", "max_transitions")}
    trainings = [{"name": f"{_plain_name(label)}-{discount}-{reward}-{seed}", "label": label, "reward": reward,
                  "method": way["method"], "planner": way.get("planner"), "discount": float(discount), "seed": seed,
                  **common,
                  "settings": {"shaped": shaped, "max_steps": EPISODE, "exact": True} | way.get("settings", {})}
                 for seed in chosen for label, way in sweep["methods"].items()
                 for discount in way.get("discounts", sweep["discounts"].values())
                 for reward, shaped in sweep["rewards"].items() if reward in way.get("rewards", sweep["rewards"])]
    together = {"seeds": list(chosen), "preset": sweep["preset"]}
    corrections = [{"name": f"correction-{discount}-{seeds}", "label": "correction", "discount": float(discount),
                    **together} for discount in sweep["discounts"].values()]
    return [*trainings, {"name": f"alone-{seeds}", "label": "alone", **together, **sweep["alone"]}, *corrections]


def _plain_name(label: str) -> str:
    return label.replace(", ", "-").replace(" ", "-")


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once, count the visits of agents, or look how long critics are wrong."""
    if settings["label"] in OF_ALL_SEEDS:
        return OF_ALL_SEEDS[settings["label"]](settings)
    options = {key: settings[key]
               for key in ("method", "planner", "settings", "preset", "seed", "max_transitions")}
    record, _ = trained("pbcs/Maze-v0", MAZE, agent_settings={"discount": settings["discount"]}, **options)
    return settings | record


def _alone(settings: dict[str, Any]) -> dict[str, Any]:
    """Train DDPG alone from the sparse reward; count its visits and record when it meets the reward first."""
    model, steps = make("pbcs/Maze-v0", MAZE), settings["steps"]
    agent = DDPG(model.observation_size, model.action_low, model.action_high, seeds=settings["seeds"],
                 settings=DDPGSettings.from_preset(settings["preset"], discount=settings["discount"]))
    loop = LoopSettings(steps, episode_steps=EPISODE, evaluate_every=steps)
    training = StackedTraining(model, agent, EpsilonGreedy(0.1), loop)
    curves = training.run()
    # The maze's observations are its states.
    visited = training.agent.state_dict([0])["replay/rows"][0, :, :model.observation_size]
    edges = [np.linspace(low, high, BINS + 1) for low, high in zip(model.state_low, model.state_high, strict=True)]
    x, y = visited.T
    visits, *_ = np.histogram2d(x, y, bins=edges)
    return {**settings, "first_reward": curves.first_reward.tolist(), "visits": visits.astype(int).tolist()}


def _correction(settings: dict[str, Any]) -> dict[str, Any]:
    """Push against a wall with a critic that has learnt a reward of 1 there, until its value has halved.

    The transition is that of [Matheron2020] 5.5: s' = s, r = 0, and the policy takes the same action in s' (actors are
    frozen). Records the number of updates, -1 where `CORRECTED` are too few.
    """
    model = make("pbcs/Maze-v0", MAZE)
    agent = DDPG(model.observation_size, model.action_low, model.action_high, seeds=settings["seeds"],
                 settings=DDPGSettings.from_preset(settings["preset"], discount=settings["discount"],
                                                   actor_learning_rate=FROZEN))
    count = len(agent.seeds)
    here = np.broadcast_to(model.observe(model.initial_state(0)[None])[None], (count, 1, 2))
    actions = agent.act(here)
    one, end = np.ones((count, 1)), np.ones((count, 1), dtype=bool)
    agent.add_transitions(here, actions, one, here, end)
    agent.train(TAUGHT)
    agent.clear_replay()
    agent.add_transitions(here, actions, 0.0 * one, here, ~end)
    learnt = agent.value(here, actions)[:, 0]
    halved = np.full(count, -1)
    for updates in range(EVERY, CORRECTED + 1, EVERY):
        agent.train(EVERY)
        halved[(halved < 0) & (agent.value(here, actions)[:, 0] < 0.5 * learnt)] = updates
        if (halved > 0).all():
            break
    return {**settings, "learnt": learnt.tolist(), "halved": halved.tolist()}


OF_ALL_SEEDS = {"alone": _alone, "correction": _correction}
