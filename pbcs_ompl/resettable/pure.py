"""The proof that wrappers only transform: the same input gives the same output, whatever was asked in between."""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.task_env import TaskEnv

TRIALS = 4
REWARDS = (0.0, 1.0, -1.0, 0.5)
TRUSTED = ("transform_observation", "transform_action", "transform_reward", "stateful_action")
"""Modules of Gymnasium; only the functions that a user hands to their wrappers may have a memory."""


def check_pure(task: TaskEnv) -> None:
    """Refuse layers of a `TaskEnv` whose outputs depend on more than their inputs.

    Raises:
        NotResettable: names the wrapper and what it changes.
    """
    doubtful = [layer for layer in task.layers if not _is_trusted(layer)]
    if not doubtful:
        return
    observations, actions = _samples(task)
    before = {layer: _attributes(layer) for layer in doubtful}
    for layer in task.layers:
        if isinstance(layer, gymnasium.ObservationWrapper):
            observations = _outputs(layer, layer.observation, observations)
    for layer in reversed(task.layers):
        if isinstance(layer, gymnasium.ActionWrapper):
            actions = _outputs(layer, layer.action, actions)
        if isinstance(layer, gymnasium.RewardWrapper):
            _outputs(layer, layer.reward, list(REWARDS))
    for layer, old in before.items():
        changed = [name for name, value in _attributes(layer).items() if name not in old or not _same(value, old[name])]
        if changed:
            raise NotResettable(f"the wrapper {type(layer).__name__} changes its attribute {changed[0]!r} while it "
                                f"transforms, so it may have a memory; make it a function of its input alone, or make "
                                f"the memory part of the environment's state")


def _is_trusted(layer: Any) -> bool:
    home = type(layer).__module__
    if home.rpartition(".")[2] not in TRUSTED or not home.startswith("gymnasium."):
        return False
    return type(layer).__name__ not in ("TransformObservation", "TransformAction", "TransformReward")


def _samples(task: TaskEnv) -> tuple[list[Any], list[Any]]:
    """Return observations of the environment within the layers, and actions for the outermost layer."""
    outer, within = deepcopy(task.action_space), deepcopy(task.bare.action_space)
    outer.seed(0)
    within.seed(0)
    actions = [outer.sample() for _ in range(TRIALS)]
    inner = [within.sample() for _ in range(TRIALS)]
    observations = [task.bare.reset(seed=0, options=task.reset_options)[0]]
    for action in inner:
        observation, _, terminated, truncated, _ = task.bare.step(action)
        observations.append(observation)
        if terminated or truncated:
            break
    return deepcopy(observations), actions


def _outputs(layer: Any, function: Callable[[Any], Any], inputs: list[Any]) -> list[Any]:
    """Return what a layer makes of its inputs, in two orders the same."""
    first = [deepcopy(function(deepcopy(value))) for value in inputs]
    again = [deepcopy(function(deepcopy(value))) for value in reversed(inputs)][::-1]
    if not all(np.array_equal(flat(one), flat(other), equal_nan=True) for one, other in zip(first, again, strict=True)):
        raise NotResettable(f"the wrapper {type(layer).__name__} gives different results for the same input, so it has "
                            f"a memory or noise that a restored state would not bring back; leave it out, or make "
                            f"its memory part of the environment's state")
    return first


def _attributes(layer: Any) -> dict[str, Any]:
    """Return copies of what a wrapper holds, but for the environment and what cannot be copied."""
    held = {}
    for name, value in vars(layer).items():
        if name in ("env", "_cached_spec", "_saved_kwargs"):
            continue
        try:
            held[name] = deepcopy(value) if not isinstance(value, gymnasium.Env) else None
        except Exception:  # whatever a foreign class raises when it is copied: then only whether it is the same one
            held[name] = value
    return held


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if hasattr(one, "__dict__") and type(one) is type(other):
        return one is other or callable(one) or _same(vars(one), vars(other))
    return bool(one == other)
