"""Choose the adapter for an environment."""

import warnings
from dataclasses import replace
from typing import Any, cast

import gymnasium

from pbcs_ompl.core.errors import InvalidOption, NotResettable, NotVerified
from pbcs_ompl.core.interfaces import GetSetEnv, ResettableModel, VectorisedEnv
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.adapters.classic import VectorEnv
from pbcs_ompl.resettable.adapters.get_set import GetSetStateModel
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv, MujocoModel
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import SuccessFlagEnv, knows_bounds
from pbcs_ompl.resettable.adapters.vectorised import VectorisedModel
from pbcs_ompl.resettable.attributes import EnvAttributes, misspelt
from pbcs_ompl.resettable.families import proved, restorable
from pbcs_ompl.resettable.fresh import EnvMaker, episode_limit, fresh_maker, spec_of
from pbcs_ompl.resettable.memory.uncovered import refuse_uncovered
from pbcs_ompl.resettable.observing import state_observer
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.resettable.simulation import simulation_of
from pbcs_ompl.resettable.supported import TaskMaker, task_env, task_maker
from pbcs_ompl.resettable.task_env import bare

MODEL_MEMBERS = {*ResettableModel.__annotations__, *(n for n in vars(ResettableModel) if not n.startswith("_"))}


def adapt(env: Any, *, goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None,
          reset_options: dict[str, Any] | None = None) -> ResettableModel:
    """Return `env` as a `ResettableModel`; a model that is already adapted is returned as it is.

    The first that fits: its own `VectorisedEnv` protocol, its own `get_env_state` and `set_env_state`, MuJoCo,
    classic control, deep copies if they prove faithful, and replayed actions, with a warning that this is slow. What
    the toolkit guesses to be the state is proved by branching (see `branching`).
    The model moves the environment within the wrappers about: give it one of its own. Wrappers that only transform
    actions, observations or rewards stay around it (see `supported.task_env`).

    Args:
        env: A `gymnasium.Env`.
        goal: What a success is, in place of what the environment reports (see `rules.goal_rule`).
        feature: What planners explore, in place of the adapter's choice (see `rules.feature_rule`).
        reset_options: What every reset gets as `options`.

    Raises:
        NotResettable: its states cannot be restored, or a wrapper may have a memory; says what to implement.
        UnsupportedSpace: its actions are no finite vector, or its observations no vectors of numbers.
        InvalidOption: a rule does not parse, or does not fit the environment.
    """
    if not isinstance(env, gymnasium.Env):
        return adapt_without_copy(env, goal=goal, feature=feature)
    make_env = fresh_maker(env)  # before anything runs in it
    return adapt_without_copy(env, goal=goal, feature=feature, reset_options=reset_options, make_env=make_env)


def adapt_without_copy(env: Any, *, goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None,
                       reset_options: dict[str, Any] | None = None,
                       make_env: EnvMaker | None = None) -> ResettableModel:
    """Return `env` as a `ResettableModel` whose fresh environments `make_env` makes; see `adapt`."""
    if not isinstance(env, gymnasium.Env):
        if goal is not None or feature is not None:
            raise InvalidOption("a goal or feature can be given to a gymnasium.Env only, not to its adapted model")
        return _as_model(env)
    limit = episode_limit(env)
    model = _choose(task_env(env, reset_options), goal, feature, task_maker(make_env, reset_options))
    model.make_env = make_env
    if limit is not None:
        model.episode_limit = model.max_episode_steps = limit
    return model


def second_model(model: ResettableModel) -> ResettableModel:
    """Return a model of a fresh environment of the task of `model`, which nothing has run in.

    Raises:
        NotVerified: no fresh environment can be made.
    """
    make_inner = task_maker(model.make_env, model.spec.reset_options)
    if make_inner is None or model.make_env is None:
        raise NotVerified(f"no fresh environment of {model.spec.id} can be made")
    if isinstance(model.env, RestorableEnv):
        second = _model_of(model.env.again(make_inner()))
    else:
        second = adapt_without_copy(model.make_env(), reset_options=model.spec.reset_options)
    second.spec, second.make_env = model.spec, model.make_env
    return second


def _choose(inner: Any, goal: Any, feature: Any, make_inner: TaskMaker | None) -> ResettableModel:
    if isinstance(inner, RestorableEnv):
        return _model_of(inner)
    if isinstance(inner, SuccessFlagEnv):
        return _as_model(GetSetStateModel(inner))
    ActionMap.of(inner.action_space)  # before anything runs
    _warn_of_misspelt(bare(inner))
    ruled = goal is not None or feature is not None
    if isinstance(inner, VectorisedEnv) and not ruled:
        return _as_model(VectorisedModel(inner))
    if isinstance(inner, GetSetEnv) and not (simulation_of(inner) is not None and not _is_vector(inner)):
        return _get_set(inner, goal, feature, make_inner)
    return _model_of(restorable(inner, goal, feature, make_inner))


def _get_set(inner: Any, goal: Any, feature: Any, make_inner: TaskMaker | None) -> ResettableModel:
    offers = EnvAttributes.of(inner)
    if goal is not None or feature is not None or not _is_complete(inner, offers):
        refuse_uncovered(inner)
        return _model_of(proved(VectorEnv(inner, goal, feature), make_inner))
    model = GetSetStateModel(inner if offers.goal_distance is not None else SuccessFlagEnv(inner, offers))
    refuse_uncovered(inner)
    proved(model.env, make_inner)
    if offers.goal_distance is not None:
        return _as_model(model)
    model.spec = spec_of(inner)
    return _as_model(model)


def _is_complete(inner: Any, offers: EnvAttributes) -> bool:
    """Return whether bounds and observations of all states are known."""
    return state_observer(inner, offers) is not None and knows_bounds(inner, offers)


def _warn_of_misspelt(env: Any) -> None:
    for name, meant in misspelt(env).items():
        warnings.warn(f"{_name(env)} has {name!r}, which is not read; did you mean {meant!r}?", stacklevel=4)


def _model_of(env: RestorableEnv) -> ResettableModel:
    model: GetSetStateModel = MujocoModel(env) if isinstance(env, MujocoEnv) else GetSetStateModel(env)
    model.spec = replace(spec_of(env.inner), goal=env.goal_rule, feature=env.feature_rule)
    return _as_model(model)


def _is_vector(env: Any) -> bool:
    """Return whether `get_env_state` returns numbers; Adroit's returns a dictionary, and lacks the warm start."""
    env.reset(seed=0)
    return not isinstance(env.get_env_state(), dict)


def _as_model(model: Any) -> ResettableModel:
    missing = sorted(name for name in MODEL_MEMBERS if not hasattr(model, name))
    if isinstance(model, str):
        raise NotResettable(f"expected a gymnasium.Env, got the string {model!r}; call make({model!r})")
    if len(missing) == len(MODEL_MEMBERS):
        raise NotResettable(f"expected a gymnasium.Env or a ResettableModel, got {type(model).__name__}")
    if missing:
        raise NotResettable(f"{type(model).__name__} is no ResettableModel; it lacks {', '.join(missing)}")
    return cast(ResettableModel, model)


def _name(env: gymnasium.Env) -> str:
    return env.spec.id if env.spec is not None else type(bare(env)).__name__
