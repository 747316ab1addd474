"""What a model can do and is asked to do, in words."""

from typing import Any

from pbcs_ompl.cli.streams import print_error
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import SuccessFlagEnv
from pbcs_ompl.resettable.feature_bounds import narrow_words

MANY = 3
"""A feature of more numbers is worth a hint."""
TINY = 1e-30
"""Smaller numbers are the width of rounding around a bound of 0."""


def describe(model: ResettableModel) -> dict[str, Any]:
    """Return adapter, capabilities, size of the state, and feature and goal as sentences."""
    env = model.env
    return {"adapter": type(env).__name__, "capabilities": sorted(model.capabilities),
            "state_size": len(model.state_low), "feature": feature_words(model), "goal": goal_words(model)}


def feature_words(model: ResettableModel) -> str:
    """Return what is explored, within which bounds, and where these come from."""
    env = model.env
    rule = model.spec.feature or "the adapter's choice"
    source = ""
    if isinstance(env, RestorableEnv):
        source = f", from {env.bounds.source}" + (f"; {narrow_words(env.bounds)}" if env.bounds.narrow else "")
    return f"{rule}: {_vector(model.feature_low)} to {_vector(model.feature_high)}{source}"


def goal_words(model: ResettableModel) -> str:
    """Return what a success is."""
    env = model.env
    rule = model.spec.goal or _unnamed_goal(env)
    measured = env.has_goal_distance if isinstance(env, RestorableEnv) else not isinstance(env, SuccessFlagEnv)
    return f"{rule} (distance < {model.goal_threshold:g})" if measured else rule


def _unnamed_goal(env: Any) -> str:
    if isinstance(env, RestorableEnv) and env.reports_success is False and not env.has_goal_distance:
        return "not known" if env.goal_is_unknown else "the end of an episode with a positive reward"
    return "what the environment reports"


def note_rules(model: ResettableModel) -> None:
    """Print on stderr what is explored and what is a success where an adapter, not the environment, decides it."""
    if isinstance(model.env, RestorableEnv):
        print_error(f"feature   {feature_words(model)}", f"goal      {goal_words(model)}")
        if model.spec.feature is None and len(model.feature_low) > MANY:
            print_error(f"hint      {len(model.feature_low)} numbers are explored; the fewer, the fewer transitions: "
                        "choose those that matter, as in --feature 'obs[0:2]'")


def ends_hint(model: ResettableModel, tree: Tree) -> list[tuple[str, str]]:
    """Return a line where episodes have ended, and only the reward could have said that this was the goal."""
    ends = int(tree.terminal.sum())
    if not ends or model.spec.goal is not None or getattr(model.env, "reports_success", None) is not False:
        return []
    return [("hint", f"{ends} nodes end an episode, none with a positive reward; if the end is the goal, say so: "
                     "--goal 'terminated>0'")]


def _vector(values: Array) -> str:
    return "[" + ", ".join(f"{0.0 if abs(value) < TINY else value:.3g}" for value in values) + "]"
