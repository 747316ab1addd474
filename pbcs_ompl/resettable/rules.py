"""Goals and features of an environment that was not made for planning, in one line of text or as functions."""

import operator
import re
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, did_you_mean
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.attributes import EnvAttributes


class Outcome(NamedTuple):
    """What a step, or a reset, of a Gymnasium environment has returned; rules are functions of it."""

    env: Any
    """The environment without wrappers, in its present state."""
    observation: Any
    reward: float
    """NaN after a reset, which no comparison holds for."""
    terminated: bool
    info: dict[str, Any]


GoalRule = Callable[[Outcome], bool]
FeatureRule = Callable[[Outcome], Array]

SOURCES: dict[str, Callable[[Outcome], Any]] = {
    "obs": lambda outcome: _whole(outcome.observation),
    "qpos": lambda outcome: _simulated(outcome.env).qpos,
    "qvel": lambda outcome: _simulated(outcome.env).qvel,
    "state": lambda outcome: _attribute(outcome.env, "state"),
    "achieved_goal": lambda outcome: _entry(outcome.observation, "achieved_goal"),
    "desired_goal": lambda outcome: _entry(outcome.observation, "desired_goal"),
    "reward": lambda outcome: [outcome.reward],
    "terminated": lambda outcome: [outcome.terminated],
    "success": lambda outcome: [reported_success(outcome)],
}
COMPARISONS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
PART = re.compile(r"\s*(\w+)\s*(?:\[\s*(\d*)\s*(:?)\s*(\d*)\s*\])?\s*")
EXAMPLES = {"goal": "'reward>0' or 'qpos[0]>=0.45'", "feature": "'qpos[0:2]' or 'obs[0],obs[3]'"}


def reported_success(outcome: Outcome) -> bool:
    """Return what the environment reports: `is_success`, `success`, else terminated with a positive reward."""
    for key in ("is_success", "success"):
        if key in outcome.info:
            return bool(outcome.info[key])
    return bool(outcome.terminated and outcome.reward > 0)


def granted_success(outcome: Outcome) -> bool:
    """Return whether the environment grants its goal: by what it reports, else by the goal distance that it declares.

    An environment with `goal_distance`, `goal_threshold` and `get_env_state` (see `attributes`) whose `info` says
    nothing is asked for the distance of the state that it is in.
    """
    offered = EnvAttributes.of(outcome.env)
    if "is_success" in outcome.info or "success" in outcome.info or offered.goal_distance is None:
        return reported_success(outcome)
    state = np.array(outcome.env.get_env_state(), dtype=np.float64)
    return bool(offered.goal_distance(state[None])[0] < (offered.goal_threshold or 0.0))


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
        rule: `SOURCE[i] OP NUMBER`: the words of `SOURCES` and >, >=, <, <=, where all of the numbers that a slice
            selects must fulfil it; or `module:function`.

    Raises:
        InvalidOption: the rule does not parse.
    """
    if ":" in rule and "[" not in rule:
        goal: GoalRule = _imported("goal", rule)
        return goal
    for symbol, compare in COMPARISONS.items():
        left, found, right = rule.partition(symbol)
        if found:
            source, limit = _parse_part("goal", rule, left), _parse_number(rule, right)
            return lambda outcome: bool(np.all(compare(source(outcome), limit)))
    raise InvalidOption(f"goal rule {rule!r} compares nothing; expected something like {EXAMPLES['goal']}")


def feature_rule(rule: str) -> FeatureRule:
    """Return a function from an outcome to the feature [F] that planners explore.

    Args:
        rule: Parts joined by commas: `SOURCE`, `SOURCE[i]`, `SOURCE[i:j]`; or `module:function`.

    Raises:
        InvalidOption: the rule does not parse.
    """
    if ":" in rule and "[" not in rule:
        feature: FeatureRule = _imported("feature", rule)
        return feature
    parts = [_parse_part("feature", rule, text) for text in rule.split(",")]
    return lambda outcome: np.concatenate([part(outcome) for part in parts])


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


def _parse_part(kind: str, rule: str, text: str) -> FeatureRule:
    match = PART.fullmatch(text)
    if match is None:
        raise InvalidOption(f"{kind} rule {rule!r} does not parse at {text.strip()!r}; expected something like "
                            f"{EXAMPLES[kind]}")
    name, first, colon, last = match.groups()
    if name not in SOURCES:
        raise InvalidOption(f"{kind} rule {rule!r}: unknown source {name!r}{did_you_mean(name, SOURCES)}")
    source, chosen = SOURCES[name], _slice(first, colon, last)

    def read(outcome: Outcome) -> Array:
        values = np.asarray(source(outcome), dtype=np.float64).ravel()
        picked = values[chosen]
        wanted = chosen.stop if chosen.stop is not None else (chosen.start or 0) + 1
        if not picked.size or wanted > len(values):
            raise InvalidOption(f"{kind} rule {rule!r}: {name} has {len(values)} numbers, 0 to {len(values) - 1}")
        return picked.copy()

    return read


def _slice(first: str | None, colon: str | None, last: str | None) -> slice:
    if first is None or (not first and not last):
        return slice(None)
    start = int(first) if first else 0
    if not colon:
        return slice(start, start + 1)
    return slice(start, int(last) if last else None)


def _parse_number(rule: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InvalidOption(f"goal rule {rule!r}: expected a number after the comparison, got {text!r}") from error


def _whole(observation: Any) -> Any:
    if isinstance(observation, dict):
        return np.concatenate([np.ravel(observation[key]) for key in sorted(observation)])
    return observation


def _simulated(env: Any) -> Any:
    data = getattr(env, "data", None)
    if not hasattr(data, "qpos"):
        raise InvalidOption(f"{type(env).__name__} is no MuJoCo environment: it has neither qpos nor qvel")
    return data


def _attribute(env: Any, name: str) -> Any:
    if not hasattr(env, name):
        raise InvalidOption(f"{type(env).__name__} has no attribute {name!r}")
    return getattr(env, name)


def _entry(observation: Any, key: str) -> Any:
    if not isinstance(observation, dict) or key not in observation:
        raise InvalidOption(f"the observation has no {key!r}; use obs, qpos or qvel")
    return observation[key]
