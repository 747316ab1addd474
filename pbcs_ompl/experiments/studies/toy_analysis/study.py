"""When a random walk on 1D-Toy finds the reward: [Matheron2020] A.4."""

from fractions import Fraction
from typing import Any

import numpy as np

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.agents.noise import EpsilonGreedy, draw_all
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.experiments.studies.toy_analysis.random_walk import densities, simulate
from pbcs_ompl.resettable import make

POSITIONS = np.linspace(-1.0, 8.0, 451)
PICTURED = (1, 2, 3, 5, 10, 21)
BIN = 0.25


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each kind of walk and seed of its simulation, and one with untrained agents."""
    walks = [{"name": f"{kind}-{seed}", "kind": kind, "share": share, "seed": seed, "walks": sweep["walks"],
              "steps": sweep["steps"], "density_after": sweep["density_after"]}
             for kind, share in sweep["shares"].items() for seed in range(seeds)]
    return [*walks, {"name": "agents", "kind": "agents", "agents": sweep["toy"]["agents"],
                      "initialisation": sweep["toy"]["initialisation"], "steps": sweep["steps"]}]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Compute the walk exactly, and simulate it."""
    if settings["kind"] == "agents":
        return _agents(settings)
    share, steps = Fraction(settings["share"]), settings["steps"]
    exact, total, pictures, masses = [], Fraction(0), {}, []
    for step, density in enumerate(densities(steps, share), start=1):
        total += density.found
        exact.append(float(total))
        if step in PICTURED:
            pictures[str(step)] = density(POSITIONS).tolist()
        if step == settings["density_after"]:
            fine = (np.arange(100) + 0.5) / 100 * BIN
            masses = [float(density(edge + fine).mean() * BIN) for edge in np.arange(-1.0, 8.0, BIN)]
    found, _ = simulate(settings["walks"], steps, float(share), seed=settings["seed"])
    _, positions = simulate(settings["walks"], settings["density_after"], float(share), seed=settings["seed"] + 10**6)
    counts, _ = np.histogram(positions, bins=np.arange(-1.0, 8.0 + BIN / 2, BIN))
    return {**settings, "exact": exact, "found": found.tolist(), "pictures": pictures, "masses": masses,
            "counts": counts.tolist(), "theorem_5": theorem_5(steps, float(share))}


def theorem_5(steps: int, share: float) -> list[float]:
    """Return the probabilities of success by the formula of Theorem 5 as it is printed.

    It mixes the densities of the walk without pauses (P_i, P_(i+1)) instead of those of the walk itself.
    """
    left, found = 1.0, []
    walk = list(densities(steps))
    for step in range(steps):
        if step == 0:
            part = float(walk[0].found / (walk[0].found + walk[0].left))
        else:
            before, after = walk[step - 1], walk[step]
            survived = float(before.left / (before.found + before.left))
            moved = share * float(after.found / (after.found + after.left))
            part = moved / (1.0 - (1.0 - share) * (1.0 - survived))
        left *= 1.0 - part
        found.append(1.0 - left)
    return found


def _agents(settings: dict[str, Any]) -> dict[str, Any]:
    """Run one episode of 1D-Toy with untrained, epsilon-greedy DDPG agents; return when each finds the reward."""
    model, steps = make("pbcs/Toy1D-v0"), settings["steps"]
    agent = DDPG(1, model.action_low, model.action_high, seeds=range(settings["agents"]),
                 settings=DDPGSettings(initialisation=settings["initialisation"]))
    noise = EpsilonGreedy(0.1)
    draws = draw_all(noise, [SeedTree(seed).child("walk").generator() for seed in agent.seeds], (steps, 1), 1)
    states, first = np.zeros((len(agent.seeds), 1)), np.full(len(agent.seeds), -1)
    largest = np.abs(agent.act(states[:, None])).max()
    for step in range(steps):
        actions = noise.apply(agent.act(model.observe(states)[:, None]), draws[:, step], np.zeros(1, dtype=bool),
                              model.action_low, model.action_high)
        outcome = model.transition(states, actions[:, 0])
        first[(first < 0) & outcome.success] = step + 1
        states = np.where(first[:, None] > 0, 0.5, outcome.states)
    return {**settings, "first_reward": first.tolist(), "largest_first_action": float(largest)}
