"""Make an environment by id, with errors that name the closest id or option."""

import inspect
import os
import sys
from collections.abc import Mapping
from contextlib import redirect_stderr
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from typing import Any

import gymnasium
from gymnasium.envs import registration

from pbcs_ompl.core.callbacks import code_of_others, describe
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, UnknownName, did_you_mean
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.core.rendering import prefer_headless_rendering, renderer_is_missing
from pbcs_ompl.resettable.adapt import adapt, adapt_without_copy
from pbcs_ompl.resettable.fresh import limited
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule

KNOWN_TO_FAIL = ("Fetch", "Hand", "FrankaKitchen", "MaMuJoCo")
"""Families of gymnasium-robotics that raise AssertionError with mujoco newer than 3.8."""
REGISTERED_BY = {"dm_control": "shimmy"}
"""Packages that register the ids of another name."""
ROBOTICS = ("PointMaze", "AntMaze", "Adroit", *KNOWN_TO_FAIL)


@checked
def make(env: str | EnvSpec | gymnasium.Env | ResettableModel, env_kwargs: dict[str, Any] | None = None, *,
         goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None, start_seed: int | None = None,
         reset_options: dict[str, Any] | None = None, max_episode_steps: int | None = None,
         **kwargs: Any) -> ResettableModel:
    """Return the resettable model of an environment, however it is given.

    Args:
        env: An id known to Gymnasium, such as "pbcs/Maze-v0" ("module:id" imports `module` first); an `EnvSpec`; a
            Gymnasium environment, which the model then moves about; or a model, which is returned as it is.
            Packages that announce environments through the entry point group `pbcs_ompl.envs` are imported first.
        env_kwargs, kwargs: Options of the environment, when `env` is an id.
        goal, feature: Rules in place of the environment's success and the adapter's feature (see `rules`).
        start_seed: Every episode starts as `reset(seed=start_seed)` does.
        reset_options: What every reset gets as `options`.
        max_episode_steps: The length of an episode, in place of the one that the id is registered with.

    Raises:
        UnknownName: no such id.
        InvalidOption: an option that the environment does not have, or a value that it refuses; options, rules or a
            start seed for what is built already.
        MissingDependency: the environment needs a library that is not installed.
        NotResettable, UnsupportedSpace: see `adapt`.

    Example:
        >>> import pbcs_ompl
        >>> model = pbcs_ompl.make("pbcs/Maze-v0", {"size": 3})
        >>> state = model.initial_state(seed=0)
        >>> outcome = model.transition(state[None], model.action_high[None])
        >>> bool((outcome.states[0] > state).all())
        True
    """
    options = {**(env_kwargs or {}), **kwargs}
    rules = {"start_seed": start_seed, "reset_options": reset_options, "max_episode_steps": max_episode_steps}
    given = {name: value for name, value in rules.items() if value is not None}
    if isinstance(env, str):
        return _make(EnvSpec(env, options, **given), goal, feature)  # type: ignore[arg-type]
    if options:
        raise InvalidOption("options of the environment go with its id; this one is built already: leave out "
                            f"{', '.join(options)}")
    if isinstance(env, EnvSpec):
        return _make(replace(env, **given), env.goal if goal is None else goal,  # type: ignore[arg-type]
                     env.feature if feature is None else feature)
    with code_of_others(f"the environment {type(env).__name__}"):
        return _with_rules(adapt(env, goal=goal, feature=feature, reset_options=reset_options), given)


def _make(spec: EnvSpec, goal: str | GoalRule | None, feature: str | FeatureRule | None) -> ResettableModel:
    load_environments()
    prefer_headless_rendering()
    spec = replace(spec, goal=goal if isinstance(goal, str) else None,
                   feature=feature if isinstance(feature, str) else None)
    make_env = partial(fresh_env, spec)
    with code_of_others(f"the environment {spec.id!r}"):
        model = adapt_without_copy(_gymnasium_make(spec), goal=goal, feature=feature, reset_options=spec.reset_options,
                                   make_env=make_env)
    model.spec = replace(model.spec, id=spec.id, start_seed=spec.start_seed, reset_options=spec.reset_options,
                         max_episode_steps=spec.max_episode_steps)  # the id with its module, if it names one
    return model


def fresh_env(spec: EnvSpec) -> gymnasium.Env[Any, Any]:
    """Return a new environment of a task, with its wrappers.

    Raises:
        UnknownName, InvalidOption, MissingDependency: see `make`.
    """
    load_environments()
    prefer_headless_rendering()
    with code_of_others(f"the environment {spec.id!r}"):
        return _gymnasium_make(spec, disable_env_checker=True)


def _gymnasium_make(spec: EnvSpec, **options: Any) -> gymnasium.Env[Any, Any]:
    spec.check_trusted(known=[spec.id] if is_registered(spec.id) else [])
    registered = _find(spec.id)
    try:
        _check_options(registered, spec.kwargs)
        return gymnasium.make(spec.id, max_episode_steps=spec.max_episode_steps, **options, **spec.kwargs)
    except (gymnasium.error.DependencyNotInstalled, ModuleNotFoundError) as error:
        extra = "robotics" if spec.id.startswith(ROBOTICS) else "mujoco"
        remedy = f" (pip install 'pbcs-ompl[{extra}]')" if "mujoco" in str(error).lower() else ""
        raise MissingDependency(f"environment {spec.id!r} needs what is not installed: {error}{remedy}") from error
    except (AttributeError, RuntimeError) as error:  # so mujoco fails on import
        if not renderer_is_missing() and "MUJOCO_GL" not in str(error):
            raise
        raise MissingDependency(f"mujoco cannot be imported with MUJOCO_GL={os.environ['MUJOCO_GL']}: install what it "
                                f"names, set MUJOCO_GL=egl, or unset it") from error
    except AssertionError as error:
        if not spec.id.rpartition(":")[2].startswith(KNOWN_TO_FAIL):
            raise
        raise MissingDependency(f"{spec.id} does not run with the installed mujoco: pip install 'mujoco<=3.8' (the "
                                f"mazes and Adroit run with newer ones)") from error
    except (TypeError, ValueError) as error:
        if not spec.kwargs:
            raise
        raise InvalidOption(f"{spec.id} refuses its options {spec.kwargs}: {describe(error)}") from error


def _with_rules(model: ResettableModel, rules: dict[str, Any]) -> ResettableModel:
    """Return a model of an environment that was built already, with a start seed, reset options or a limit."""
    model.spec = replace(model.spec, **rules)
    steps, make_env = model.spec.max_episode_steps, model.make_env
    if steps is not None and "max_episode_steps" in rules:
        model.episode_limit = model.max_episode_steps = steps
        model.make_env = None if make_env is None else lambda: limited(make_env(), steps)
    return model


def is_registered(env_id: str) -> bool:
    """Return whether Gymnasium knows this id, and nothing has to be imported for it."""
    module, _, name = env_id.rpartition(":")
    return name in gymnasium.registry and (not module or module in sys.modules)


def is_known(env_id: str) -> bool:
    """Return whether `make` finds an environment of this id here."""
    load_environments()
    try:
        _find(env_id)
    except (UnknownName, MissingDependency):
        return False
    return True


def _find(env_id: str) -> registration.EnvSpec:
    if env_id.endswith(")"):  # see `fresh.spec_of`
        raise InvalidOption(f"{env_id} was handed over as an object in wrappers, which its name does not make again; "
                            f"use it from Python, as in pbcs_ompl.evaluate(chain, env), or register it with its "
                            f"wrappers: gymnasium.register(..., additional_wrappers=...)")
    module, _, name = env_id.rpartition(":")
    try:
        if module:
            import_module(module)
        if name not in gymnasium.registry and name.startswith(ROBOTICS):
            _register_robotics()
        return gymnasium.spec(name)
    except ModuleNotFoundError as error:
        remedy = ": pip install 'pbcs-ompl[robotics]'" if error.name == "gymnasium_robotics" else ""
        raise MissingDependency(f"environment {env_id!r}: there is no module {error.name!r}{remedy}") from error
    except gymnasium.error.Error as error:
        raise UnknownName("environment", env_id, _choices(module, name), _of_a_module(env_id)) from error
    except (Exception, SystemExit) as error:
        raise InvalidOption(f"environment {env_id!r}: cannot import {module!r}: {describe(error)}") from error


def _of_a_module(env_id: str) -> str:
    """Return how to name an environment that a package registers when it is imported."""
    if ":" in env_id or env_id.startswith("pbcs/"):
        return ""
    space = env_id.partition("/")[0]
    space = REGISTERED_BY.get(space, space)
    there = space != env_id and space.isidentifier() and find_spec(space) is not None
    return (f" (an environment that a package registers when it is imported is named with it: "
            f"{space if there else 'my_package'}:{env_id})")


def _register_robotics() -> None:
    """Import gymnasium-robotics, which registers its environments, without the notice that it prints."""
    with redirect_stderr(StringIO()):
        import_module("gymnasium_robotics")


def _choices(module: str, env_id: str) -> list[str]:
    """Return the ids of a module, where one is named; else all if one is close, else those of plug-ins only."""
    ids = list(gymnasium.registry)
    own = [known for known in ids if module and str(gymnasium.registry[known].entry_point).startswith(module)]
    close = "did you mean" in did_you_mean(env_id, ids)
    return own or (ids if close else [known for known in ids if known.startswith("pbcs/")])


def _check_options(spec: registration.EnvSpec, kwargs: dict[str, Any]) -> None:
    """Refuse options that the environment's constructor does not take."""
    creator: Any = spec.entry_point
    if isinstance(creator, str):
        creator = registration.load_env_creator(creator)
    parameters = _parameters(creator)
    if any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values()):
        return
    for name in kwargs:
        if name not in parameters:
            raise InvalidOption(f"{spec.id} has no option {name!r}{did_you_mean(name, parameters)}")


@cache
def _parameters(creator: Any) -> Mapping[str, inspect.Parameter]:
    return inspect.signature(creator).parameters
