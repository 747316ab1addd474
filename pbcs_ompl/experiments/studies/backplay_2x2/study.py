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


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, reward, discount and method, and one of all seeds of DDPG alone."""
    chosen = range(sweep["first_seed"], sweep["first_seed"] + seeds)
    common = {key: sweep[key] for key in ("preset", "max_transitions")}
    trainings = [{"name": f"{_plain_name(label)}-{discount}-{reward}-{seed}", "label": label, "reward": reward,
                  "method": way["method"], "planner": way.get("planner"), "discount": float(discount), "seed": seed,
                  **common,
                  "settings": {"shaped": shaped, "max_steps": EPISODE, "exact": True} | way.get("settings", {})}
                 for seed in chosen for label, way in sweep["methods"].items()
                 for discount in way.get("discounts", sweep["discounts"].values())
                 for reward, shaped in sweep["rewards"].items() if reward in way.get("rewards", sweep["rewards"])]
    return [*trainings, {"name": f"alone-{seeds}", "label": "alone", "seeds": list(chosen), "preset": sweep["preset"],
                         **sweep["alone"]}]


def _plain_name(label: str) -> str:
    return label.replace(", ", "-").replace(" ", "-")


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once, or count the visits of agents."""
    if settings["label"] == "alone":
        return _alone(settings)
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
