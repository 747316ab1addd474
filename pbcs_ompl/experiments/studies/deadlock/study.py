"""Why DDPG fails on the simplest problem there is: [Matheron2020] Figs. 6.2-6.5, 6.9(b), 6.10(a,b)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pbcs_ompl.agents.noise import make_noise
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.diagnostics import returns_of, value_slices
from pbcs_ompl.experiments.diagnostic_batch import DiagnosticBatch
from pbcs_ompl.experiments.stacked_training import LoopSettings, StackedTraining, chunks
from pbcs_ompl.resettable import make

MAPPED_STATES = np.linspace(0.0, 1.0, 101)
HORIZON = 50
MOST_CRITICS = 3
DIGITS = 5
"""Of the numbers in a record."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each stack of each variant, the first seeds of all variants first, and one on Drift."""
    common = {"agent_settings": sweep["agent"], "device": sweep["device"]}
    stack = sweep["stack"][sweep["device"].partition(":")[0]]
    stacks = [{"name": f"{variant}-{chunk[0]}-{chunk[-1]}", "variant": variant, "seeds": chunk, "loop": sweep["loop"],
               **common, **options}
              for variant, options in sweep["variants"].items()
              for chunk in chunks(min(seeds, options.get("most_seeds", seeds)), stack)]
    stacks.sort(key=lambda settings: settings["seeds"][0])
    return [*stacks, {"name": "drift", "variant": "drift", "agent": "ddpg", "drift": sweep["drift"], **common}]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train one stack on 1D-Toy, or let one drift."""
    if settings["variant"] == "drift":
        return _drift(settings)
    model = make("pbcs/Toy1D-v0")
    agent, probe = _agent(settings, model, settings["seeds"]), DiagnosticBatch(model)
    discount = settings["agent_settings"]["discount"]
    observers = probe.observers() | {
        "distance_to_returns": lambda agent: probe.distance_to_returns(agent, discount, HORIZON),
        "mean_action": probe.mean_action}
    expert_after = settings.get("expert_after")
    expert: Callable[[Array], Array] | None = None if expert_after is None else (
        lambda states: np.broadcast_to(model.action_low, (len(states), 1)))
    loop = LoopSettings(**settings["loop"], expert_after=expert_after or 0)
    training = StackedTraining(model, agent, make_noise(settings["noise"]), loop, expert=expert, observers=observers)
    curves = training.run()
    failed = np.flatnonzero(~curves.success[-1][training.active])
    return {"variant": settings["variant"], "loop": settings["loop"], "expert_after": expert_after, **curves.summary(),
            "critics": _critics(model, training.agent, failed[:MOST_CRITICS]) if len(failed) else []}


def _agent(settings: dict[str, Any], model: ResettableModel, seeds: list[int]) -> StackedAgent:
    kind = load("agent", settings["agent"])
    # A GPU's update would be compiled again each time that the stack shrinks.
    agent: StackedAgent = kind(model.observation_size, model.action_low, model.action_high, seeds=seeds,
                               device=settings["device"],
                               settings=kind.settings_type(**settings["agent_settings"]),
                               compile="auto" if settings["device"] == "cpu" else False)
    return agent


def _critics(model: ResettableModel, agent: StackedAgent, failed: IndexArray) -> list[dict[str, Any]]:
    """Return Q and Q^pi along the states and the actions, and the actor's actions, of some seeds of the stack."""
    states = np.broadcast_to(MAPPED_STATES[:, None], (len(agent.seeds), len(MAPPED_STATES), 1))
    line, values = value_slices(agent.value, states, agent.action_low, agent.action_high)
    actions = agent.act(states)[..., 0]
    here, controls = (np.broadcast_to(grid.reshape(-1, 1), (len(agent.seeds), grid.size, 1))
                      for grid in np.meshgrid(MAPPED_STATES, line, indexing="ij"))
    returns = returns_of(model, agent.act, here, controls, agent.settings.discount, HORIZON).reshape(values.shape)
    return [{"seed": agent.seeds[index], "states": MAPPED_STATES.tolist(), "actions": line.tolist(),
             "values": values[index].round(DIGITS).tolist(), "returns": returns[index].round(DIGITS).tolist(),
             "chosen": actions[index].round(DIGITS).tolist()} for index in failed]


def _fill_without_reward(agent: StackedAgent, count: int) -> None:
    """Fill the replay buffers with random transitions of Drift."""
    model, flat = make("pbcs/Drift-v0"), (len(agent.seeds) * count, 1)
    rng = np.random.default_rng(0)
    states, controls = rng.uniform(0.0, 1.0, flat), rng.uniform(model.action_low, model.action_high, flat)
    outcome = model.transition(states, controls)
    shape = (len(agent.seeds), count)
    agent.add_transitions(states.reshape(*shape, -1), controls.reshape(*shape, -1), outcome.rewards.reshape(shape),
                   outcome.states.reshape(*shape, -1), outcome.terminated.reshape(shape))


def _drift(settings: dict[str, Any]) -> dict[str, Any]:
    """Train on random transitions without any reward; record how far actor and critic drift."""
    model, drift = make("pbcs/Drift-v0"), settings["drift"]
    seeds = list(range(drift["seeds"]))
    agent, probe = _agent(settings, model, seeds), DiagnosticBatch(model)
    _fill_without_reward(agent, drift["transitions"])
    observers = {"largest_value": probe.largest_value, "largest_action": probe.largest_action,
                 "mean_action": probe.mean_action}
    rows = {name: [observe(agent)] for name, observe in observers.items()}
    for _ in range(drift["updates"] // drift["every"]):
        agent.train(drift["every"])
        for name, observe in observers.items():
            rows[name].append(observe(agent))
    steps = np.arange(len(rows["largest_value"])) * drift["every"]
    curves = {name: np.array(row).round(DIGITS).tolist() for name, row in rows.items()}
    return {"variant": "drift", "updates": steps.tolist(), **curves}

