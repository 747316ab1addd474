"""DDPG from an exploration tree, with and without rollouts of its own: [Matheron2020] 4.2 to 4.7."""

from typing import Any

import numpy as np

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.agents.noise import EpsilonGreedy
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.stacked_training import LoopSettings, StackedTraining, chunks, solved
from pbcs_ompl.resettable import make
from pbcs_ompl.skills.exploration import explore

MAZE = {"wall_penalty": -1.0, "terminate_on_success": False}
"""The mazes of chapter 4."""
GRID = 60
"""Cells of the pictures along each axis."""
HALF_WALL = 0.05
"""Half the thickness of a wall: so far the outer walls reach into the maze."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each stack of each variant, the first seeds of all variants first, and one of mini-batches."""
    common = {key: sweep[key] for key in ("evaluate_every", "episode_steps", "device")}
    stacks = [{"name": f"{variant}-{chunk[0]}-{chunk[-1]}", "variant": variant, "seeds": chunk, **common, **options,
               "agent": sweep["agent"] | options.get("agent", {})}
              for variant, options in sweep["variants"].items() for chunk in chunks(seeds, sweep["stack"])]
    stacks.sort(key=lambda settings: settings["seeds"][0])
    return [*stacks, {"name": f"mini-batch-{seeds}", "variant": "mini-batch", "seeds": list(range(seeds)),
                      **sweep["mini_batch"]}]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Explore, train, and record the critic of the first seed; or sample a mini-batch."""
    model = make("pbcs/Maze-v0", MAZE | {"size": settings["size"]} | settings.get("maze", {}))
    if settings["variant"] == "mini-batch":
        return settings | _mini_batches(model, settings["seeds"], settings["explored"], settings["count"])
    agent, curves = _trained(model, settings, settings["seeds"], settings["steps"])
    pictures = [_picture(agent, model, settings["episode_steps"]) | {"steps": settings["steps"]}]
    for steps in settings.get("pictured", []):
        # A seed does alone what it does in the stack: this is what it was like on its way.
        earlier, _ = _trained(model, settings, settings["seeds"][:1], steps)
        pictures.append(_picture(earlier, model, settings["episode_steps"]) | {"steps": steps})
    kept = {key: settings[key] for key in ("variant", "seeds", "size", "figure", "explored", "updates", "steps")}
    return {**kept, **curves, "pictures": pictures}


def _trained(model: ResettableModel, settings: dict[str, Any], seeds: list[int],
             steps: int) -> tuple[StackedAgent, dict[str, Any]]:
    agent = DDPG(model.observation_size, model.action_low, model.action_high, seeds=seeds, device=settings["device"],
                 settings=DDPGSettings(**settings["agent"]))
    if settings["explored"]:
        _fill(agent, model, settings["explored"])
    return agent, _offline(agent, model, settings) if settings["updates"] else _with_rollouts(agent, model, settings,
                                                                                              steps)


def _mini_batches(model: ResettableModel, seeds: list[int], explored: int, count: int) -> dict[str, Any]:
    """Count the transitions that a wall stopped, and those that an inner one stopped; draw one mini-batch."""
    found = [explore(model, explored, seed + 1) for seed in seeds]
    low, high = model.state_low + HALF_WALL, model.state_high - HALF_WALL
    stopped = [one.rewards < 0.0 for one in found]
    inner = [hit & ((one.states + one.controls > low) & (one.states + one.controls < high)).all(axis=1)
             for one, hit in zip(found, stopped, strict=True)]
    rows = np.random.default_rng(0).integers(explored, size=count)
    return {"stopped": [int(hits.sum()) for hits in stopped], "stopped_inside": [int(hits.sum()) for hits in inner],
            "batch": [found[0].states[rows].tolist(), found[0].next_states[rows].tolist()]}


def _fill(agent: StackedAgent, model: ResettableModel, count: int) -> None:
    """Fill each seed's replay buffer with an exploration of its own. No state is terminal in chapter 4."""
    found = [explore(model, count, seed + 1) for seed in agent.seeds]
    agent.add_transitions(np.stack([one.states for one in found]), np.stack([one.controls for one in found]),
                   np.stack([one.rewards for one in found]), np.stack([one.next_states for one in found]),
                   np.zeros((len(found), count), dtype=np.bool_))


def _offline(agent: StackedAgent, model: ResettableModel, settings: dict[str, Any]) -> dict[str, Any]:
    starts = np.array([model.initial_state(seed) for seed in agent.seeds])
    every, success = settings["evaluate_every"], []
    with one_thread():
        for _ in range(settings["updates"] // every):
            agent.train(every)
            success.append(solved(model, agent, starts, settings["episode_steps"]).astype(int).tolist())
    return {"at": [every * (row + 1) for row in range(len(success))], "success": success}


def _with_rollouts(agent: StackedAgent, model: ResettableModel, settings: dict[str, Any], steps: int) -> dict[str, Any]:
    loop = LoopSettings(steps, episode_steps=settings["episode_steps"],
                        evaluate_every=settings["evaluate_every"])
    curves = StackedTraining(model, agent, EpsilonGreedy(0.1), loop, observers={
        "wall_hits": _share_of_wall_hits, "wall_value": _value_below_the_wall,
        "goal_value": lambda agent: _value_in_the_goal(agent, model)}).run()
    return {"at": curves.steps, "success": np.array(curves.success).astype(int).tolist(),
            "observed": {name: np.array(rows).round(4).tolist() for name, rows in curves.observed.items()}}


def _share_of_wall_hits(agent: StackedAgent) -> Array:
    """Return which share of the replay buffer has hit a wall, and so the expected share in mini-batches (4.6) [S]."""
    rewards = agent.replay.state_dict()["rows"][..., 2 * len(agent.action_low)]  # observations are as wide as actions
    share: Array = (rewards < 0.0).sum(axis=1) / np.maximum(1, agent.replay.sizes)
    return share


def _value_below_the_wall(agent: StackedAgent) -> Array:
    """Return the mean of Q for going straight up from just below the inner wall of the 2x2 maze [S]."""
    states = np.stack([np.linspace(0.1, 0.9, 9), np.full(9, 1.0 - HALF_WALL - 0.02)], axis=1)
    return _values(agent, states, np.tile([0.0, agent.action_high[1]], (9, 1)))


def _value_in_the_goal(agent: StackedAgent, model: ResettableModel) -> Array:
    """Return Q in the middle of the goal for standing still [S]."""
    assert model.goal_circle is not None
    return _values(agent, np.array([model.goal_circle[:2]]), np.zeros((1, 2)))


def _values(agent: StackedAgent, states: Array, actions: Array) -> Array:
    """Return the mean of Q over states and actions [B, ...] that are their own observations [S]."""
    seeds = len(agent.seeds)
    mean: Array = agent.value(*(np.repeat(one[None], seeds, axis=0) for one in (states, actions))).mean(axis=1)
    return mean


def _picture(agent: StackedAgent, model: ResettableModel, steps: int) -> dict[str, Any]:
    """Return Q(s, pi(s)) and pi(s) of the first seed on a grid, and one rollout."""
    middle = (np.arange(GRID) + 0.5) / GRID * model.state_high[0]
    states = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
    observations = np.repeat(states[None], len(agent.seeds), axis=0)
    actions = agent.act(observations)
    return {"values": agent.value(observations, actions)[0].tolist(), "actions": actions[0].tolist(),
            "rollout": _rollout(agent, model, steps).tolist()}


def _rollout(agent: StackedAgent, model: ResettableModel, steps: int) -> Array:
    state = model.initial_state(agent.seeds[0])
    trace = [state]
    for _ in range(steps):
        action = agent.act(np.repeat(state[None, None], len(agent.seeds), axis=0))[0]
        outcome = model.transition(state[None], action)
        state = outcome.states[0]
        trace.append(state)
        if outcome.success[0]:
            break
    return np.array(trace)
