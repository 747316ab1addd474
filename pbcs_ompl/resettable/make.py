"""Make an environment by id, with errors that name the closest id or option."""

import inspect
import os
from contextlib import redirect_stderr
from importlib import import_module
from io import StringIO
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from pbcs_ompl.core.contracts import ResetAnywhere
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, UnknownName, did_you_mean
from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.core.rendering import prefer_headless_rendering, renderer_is_missing
from pbcs_ompl.resettable.adapt import adapt
from pbcs_ompl.resettable.model import FEATURE_KEY, GOAL_KEY, START_KEY
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule

KNOWN_TO_FAIL = ("Fetch", "Hand", "FrankaKitchen", "MaMuJoCo")
"""Families of gymnasium-robotics that raise AssertionError with mujoco newer than 3.8."""
ROBOTICS = ("PointMaze", "AntMaze", "Adroit", *KNOWN_TO_FAIL)


def make(env_id: str, env_kwargs: dict[str, Any] | None = None, *, goal: str | GoalRule | None = None,
         feature: str | FeatureRule | None = None) -> ResetAnywhere:
    """Make the environment `env_id` and return it as a `ResetAnywhere`.

    Args:
        env_id: An id known to Gymnasium, such as "pbcs/Maze-v0". Packages that announce environments through
            the entry point group `pbcs_ompl.envs` are imported first; "module:id" imports `module` too.
        env_kwargs: Options of the environment. The keys "--goal" and "--feature" are those of a model's own
            `env_kwargs`: they stand for the two arguments below. "--start-seed" fixes the seed of every start.
        goal, feature: Rules in place of the environment's success and the adapter's feature (see `rules`).

    Raises:
        UnknownName: no such id.
        InvalidOption: an option that the environment does not have, or a value that it refuses.
        MissingDependency: the environment needs a library that is not installed.
        NoResetAnywhere, UnsupportedSpace: see `adapt`.
    """
    load_environments()
    prefer_headless_rendering()
    kwargs = dict(env_kwargs or {})
    kept_goal, kept_feature = kwargs.pop(GOAL_KEY, None), kwargs.pop(FEATURE_KEY, None)
    start_seed = kwargs.pop(START_KEY, None)
    spec = _find(env_id)
    try:
        _check_options(spec, kwargs)
        env = gymnasium.make(env_id, **kwargs)
    except (gymnasium.error.DependencyNotInstalled, ModuleNotFoundError) as error:
        extra = "robotics" if env_id.startswith(ROBOTICS) else "mujoco"
        remedy = f" (pip install 'pbcs-ompl[{extra}]')" if "mujoco" in str(error).lower() else ""
        raise MissingDependency(f"environment {env_id!r} needs what is not installed: {error}{remedy}") from error
    except (AttributeError, RuntimeError) as error:  # so mujoco fails on import
        if not renderer_is_missing() and "MUJOCO_GL" not in str(error):
            raise
        raise MissingDependency(f"mujoco cannot be imported with MUJOCO_GL={os.environ['MUJOCO_GL']}: install what it "
                                f"names, set MUJOCO_GL=egl, or unset it") from error
    except AssertionError as error:
        if not env_id.startswith(KNOWN_TO_FAIL):
            raise
        raise MissingDependency(f"{env_id} does not run with the installed mujoco: pip install 'mujoco<=3.8' (the "
                                f"mazes and Adroit run with newer ones)") from error
    except (TypeError, ValueError) as error:
        raise InvalidOption(f"{env_id} refuses its options {kwargs}: {error}") from error
    model = adapt(env, goal=kept_goal if goal is None else goal, feature=kept_feature if feature is None else feature)
    model.env_id = env_id  # with its module, if it names one
    if start_seed is not None:
        _fix_start(model, start_seed)
    return model


def is_known(env_id: str) -> bool:
    """Return whether `make` finds an environment of this id here."""
    load_environments()
    try:
        _find(env_id)
    except (UnknownName, MissingDependency):
        return False
    return True


def open_model(env: str | gymnasium.Env | ResetAnywhere, env_kwargs: dict[str, Any] | None = None) -> ResetAnywhere:
    """Return the model of what a user names as an environment: an id, an environment, or a model.

    Raises:
        InvalidOption: options for an environment that is built already.
        UnknownName, MissingDependency, NoResetAnywhere, UnsupportedSpace: see `make` and `adapt`.
    """
    if isinstance(env, str):
        return make(env, env_kwargs or {})
    if env_kwargs:
        raise InvalidOption("env_kwargs go with the id of an environment; this one is built already")
    return adapt(env)


def _find(env_id: str) -> EnvSpec:
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
        raise UnknownName("environment", env_id, _choices(name)) from error


def _fix_start(model: Any, seed: Any) -> None:
    """Let every episode of a model begin as `reset(seed)`: one start and one goal, as the thesis's MDPs have."""
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise InvalidOption(f"{START_KEY}={seed!r}: expected an integer >= 0")
    begin = model.initial_state
    model.initial_state = lambda _=None: begin(seed)
    model.env_kwargs[START_KEY] = seed


def _register_robotics() -> None:
    """Import gymnasium-robotics, which registers its environments, without the notice that it prints."""
    with redirect_stderr(StringIO()):
        import_module("gymnasium_robotics")


def _choices(env_id: str) -> list[str]:
    """Return all ids if one is close to `env_id`, else those of plug-ins only: the list would be long."""
    ids = list(gymnasium.registry)
    close = "did you mean" in did_you_mean(env_id, ids)
    return ids if close else [known for known in ids if known.startswith("pbcs/")]


def _check_options(spec: EnvSpec, kwargs: dict[str, Any]) -> None:
    """Refuse options that the environment's constructor does not take."""
    creator: Any = spec.entry_point
    if isinstance(creator, str):
        creator = load_env_creator(creator)
    parameters = inspect.signature(creator).parameters
    if any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values()):
        return
    for name in kwargs:
        if name not in parameters:
            raise InvalidOption(f"{spec.id} has no option {name!r}{did_you_mean(name, parameters)}")
