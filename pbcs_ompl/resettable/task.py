"""The task of an environment, without a model of it: what the judge needs."""

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import gymnasium

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, NotResettable, UnsupportedSpace
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.resettable.adapt import adapt_without_copy
from pbcs_ompl.resettable.fresh import EnvMaker, fresh_maker, spec_of
from pbcs_ompl.resettable.make import fresh_env
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule, rule_text
from pbcs_ompl.resettable.supported import task_env


class Task(NamedTuple):
    """What is asked for, and what makes environments in which it is asked."""

    spec: EnvSpec
    make_env: EnvMaker | None


def task_of(env: str | EnvSpec | gymnasium.Env[Any, Any] | ResettableModel, env_kwargs: dict[str, Any] | None = None, *,
            goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None,
            start_seed: int | None = None, reset_options: dict[str, Any] | None = None,
            max_episode_steps: int | None = None) -> Task:
    """Return the task that `pbcs_ompl.make` with the same arguments makes a model of.

    Args:
        env, env_kwargs, goal, feature, start_seed, reset_options, max_episode_steps: See `pbcs_ompl.make`.

    Raises:
        UnknownName, InvalidOption, MissingDependency: see `pbcs_ompl.make`.
    """
    rules: dict[str, Any] = {
        "goal": None if goal is None else rule_text("goal", goal),
        "feature": None if feature is None else rule_text("feature", feature),
        "start_seed": start_seed, "reset_options": reset_options, "max_episode_steps": max_episode_steps}
    given = {name: value for name, value in rules.items() if value is not None}
    if isinstance(env, str):
        return _of_spec(EnvSpec(env, env_kwargs or {}, **given))
    if env_kwargs:
        raise InvalidOption("options of the environment go with its id; this one is built already")
    if isinstance(env, EnvSpec):
        return _of_spec(replace(env, **given))
    if isinstance(env, gymnasium.Env):
        make_env = fresh_maker(env, max_episode_steps)
        return Task(replace(_spec_with_wrappers(env), **given), make_env)
    if given:
        raise InvalidOption(f"{', '.join(given)}: this model is built already; give them to pbcs_ompl.make")
    model = adapt_without_copy(env)  # refuses what is none
    return Task(model.spec, model.make_env)


def _spec_with_wrappers(env: gymnasium.Env[Any, Any]) -> EnvSpec:
    """Return the spec that a model of `env` has; where it can have none, controllers need none, that of `env`."""
    try:
        return spec_of(task_env(env))
    except (NotResettable, UnsupportedSpace):
        return spec_of(env)


def _of_spec(spec: EnvSpec) -> Task:
    env = fresh_env(spec)
    kwargs = spec_of(env).kwargs  # without those that the id is registered with
    env.close()
    return Task(replace(spec, kwargs=kwargs), partial(fresh_env, spec))
