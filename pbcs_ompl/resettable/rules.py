"""Goals and features of an environment that was not made for planning, in one line of text or as functions."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, did_you_mean
from pbcs_ompl.core.interfaces import GetSetEnv
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.rule_language import WORDS, Values, parse_conditions, parse_values
from pbcs_ompl.resettable.simulation import simulation_of
from pbcs_ompl.resettable.task_env import bare


class Outcome(NamedTuple):
    """What a step, or a reset, of a Gymnasium environment has returned; rules are functions of it."""

    env: Any
    """The environment without wrappers, in its present state."""
    observation: Any
    reward: float
    """NaN after a reset, which no comparison holds for."""
    terminated: bool
    info: dict[str, Any]
    named: Any = None
    """The observation below wrappers that flatten it, in which a feature finds the goals by their names."""


SUCCESS = ("is_success", "success")
"""The keys of `info` in which environments report success, the first that is there."""
GoalRule = Callable[[Outcome], bool]
FeatureRule = Callable[[Outcome], Array]

EXAMPLES = {"goal": "'reward>0' or 'qpos[0]>=0.45 and |qvel[0]|<0.1'", "feature": "'qpos[0:2]' or 'obs[0],obs[3]'"}


def reported_success(outcome: Outcome) -> bool:
    """Return what the environment reports: `is_success`, `success`, else terminated with a positive reward.

    Raises:
        CallbackFailed: it reports what is neither true nor false.
    """
    for key in SUCCESS:
        if key in outcome.info:
            return _truth(key, outcome.info[key])
    return bool(outcome.terminated and outcome.reward > 0)


def granted_success(outcome: Outcome) -> bool:
    """Return whether the environment grants its goal: by what it reports, else by the goal distance that it declares.

    An environment with `goal_distance`, `goal_threshold` and `get_env_state` (see `attributes`) whose `info` says
    nothing is asked for the distance of the state that it is in.
    """
    if any(key in outcome.info for key in SUCCESS):
        return reported_success(outcome)
    offered = EnvAttributes.of(outcome.env)
    if offered.goal_distance is None:
        return reported_success(outcome)
    state = np.array(outcome.env.get_env_state(), dtype=np.float64)
    return bool(offered.goal_distance(state[None])[0] < (offered.goal_threshold or 0.0))


def _truth(key: str, value: Any) -> bool:
    """Return a success as one flag; None and NaN are none."""
    if value is None:
        return False
    array = np.asarray(value)
    if array.dtype.kind not in "biuf" or array.size != 1:
        raise CallbackFailed(f"info[{key!r}] is {value!r}; expected True or False")
    number = float(array.item())
    return number != 0.0 and not np.isnan(number)


def rule_text(kind: str, rule: str | GoalRule | FeatureRule) -> str:
    """Return a rule as text, which makes the same rule again in another process: of a function, `module:name`.

    Raises:
        InvalidOption: the rule is neither text nor a function that can be imported.
    """
    if isinstance(rule, str):
        return rule
    module, name = getattr(rule, "__module__", None), getattr(rule, "__qualname__", "?")
    if not callable(rule) or module is None or _found(module, name) is not rule:
        raise InvalidOption(f"{kind}={rule!r}: expected a rule such as {EXAMPLES[kind]}, or a function at the top "
                            f"level of a module, so that it is found again when a trajectory is replayed")
    return f"{module}:{name}"


def goal_rule(rule: str) -> GoalRule:
    """Return a function that says whether an outcome is a success.

    Args:
        rule: Conditions joined by `and`, each `VALUES OP NUMBER` (see `rule_language`), where all of the numbers that
            a slice selects must fulfil it; or `module:function`.

    Raises:
        InvalidOption: the rule does not parse.
    """
    if _is_function(rule):
        goal: GoalRule = _imported("goal", rule)
        return goal
    conditions = parse_conditions(rule, EXAMPLES["goal"])
    return lambda outcome: all(condition.holds(_read("goal", rule, condition.values, outcome))
                               for condition in conditions)


def feature_rule(rule: str) -> FeatureRule:
    """Return a function from an outcome to the feature [F] that planners explore.

    Args:
        rule: Values joined by commas (see `rule_language`); or `module:function`.

    Raises:
        InvalidOption: the rule does not parse.
    """
    if _is_function(rule):
        feature: FeatureRule = _imported("feature", rule)
        return feature
    chosen = parse_values(rule, EXAMPLES["feature"])
    return lambda outcome: np.concatenate([_read("feature", rule, values, outcome) for values in chosen])


def selected_dims(rule: str, source: str, size: int) -> Sequence[int] | None:
    """Return which of the `size` numbers of a source a feature rule selects, in order; None if it reads others."""
    if _is_function(rule):
        return None
    chosen = parse_values(rule, EXAMPLES["feature"])
    if any(values.source != source or values.absolute for values in chosen):
        return None
    return [dim for values in chosen for dim in range(size)[values.part]]


def _is_function(rule: str) -> bool:
    return ":" in rule and "[" not in rule


def _read(kind: str, rule: str, values: Values, outcome: Outcome) -> Array:
    """Return the numbers [N] that `values` selects of an outcome."""
    found = np.asarray(SOURCES[values.source](outcome, values.keys), dtype=np.float64).ravel()
    if not values.fits(len(found)):
        raise InvalidOption(f"{kind} rule {rule!r}: {values.name} has {len(found)} numbers, 0 to {len(found) - 1}")
    picked: Array = found[values.part].copy()
    return np.abs(picked) if values.absolute else picked


def _imported(kind: str, rule: str) -> Any:
    module, _, name = rule.partition(":")
    function = _found(module.strip(), name.strip())
    if not callable(function):
        raise InvalidOption(f"{kind} rule {rule!r}: there is no such function; expected module:function, or something "
                            f"like {EXAMPLES[kind]}")
    return function


def _found(module: str, name: str) -> Any:
    try:
        return getattr(import_module(module), name, None)
    except (ImportError, ValueError):
        return None


def _simulated(env: Any) -> Any:
    simulation = simulation_of(env)
    data = getattr(env, "data", None) if simulation is None else simulation.data
    if not hasattr(data, "qpos"):
        raise InvalidOption(f"{type(bare(env)).__name__} is no MuJoCo environment: it has neither qpos nor qvel")
    return data


def _state(env: Any) -> Any:
    """Return what the environment says is its state."""
    if isinstance(env, GetSetEnv) and simulation_of(env) is None:
        return env.get_env_state()
    state = getattr(env, "state", None)
    if state is None:
        raise InvalidOption(f"{type(bare(env)).__name__} has neither get_env_state() nor an attribute 'state'; choose "
                            f"from {', '.join(sorted(set(SOURCES) - {'state'}))}")
    return state


def _entry(outcome: Outcome, key: str) -> Any:
    for observation in (outcome.observation, outcome.named):
        if isinstance(observation, dict) and key in observation:
            return observation[key]
    raise InvalidOption(f"the observation has no {key!r}; use obs, qpos or qvel")


def _from_info(outcome: Outcome, keys: tuple[str, ...]) -> Any:
    """Return what `info` holds under keys; NaN, for which no comparison holds, where a reset does not report it yet."""
    found: Any = outcome.info
    for key in keys:
        if not isinstance(found, dict) or key not in found:
            if np.isnan(outcome.reward):
                return [np.nan]
            known = found if isinstance(found, dict) else {}
            raise InvalidOption(f"info has no {key!r}{did_you_mean(key, [str(name) for name in known])}")
        found = found[key]
    try:
        return np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidOption(f"info{''.join(f'[{key}]' for key in keys)} is {found!r}; expected numbers") from error


SOURCES: dict[str, Callable[[Outcome, tuple[str, ...]], Any]] = {
    "obs": lambda outcome, _: flat(outcome.observation),
    "qpos": lambda outcome, _: _simulated(outcome.env).qpos,
    "qvel": lambda outcome, _: _simulated(outcome.env).qvel,
    "state": lambda outcome, _: _state(outcome.env),
    "achieved_goal": lambda outcome, _: _entry(outcome, "achieved_goal"),
    "desired_goal": lambda outcome, _: _entry(outcome, "desired_goal"),
    "reward": lambda outcome, _: [outcome.reward],
    "terminated": lambda outcome, _: [outcome.terminated],
    "success": lambda outcome, _: [reported_success(outcome)],
    "info": _from_info,
}
assert set(SOURCES) == set(WORDS)
