"""Make an environment by id, with errors that name the closest id or option."""

import inspect
from importlib import import_module
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from pbcs_ompl.core.contracts import ResetAnywhere
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, UnknownName, did_you_mean
from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.reset_anywhere.adapt import adapt


def make(env_id: str, env_kwargs: dict[str, Any] | None = None) -> ResetAnywhere:
    """Make the environment `env_id` and return it as a `ResetAnywhere`.

    Args:
        env_id: An id known to Gymnasium, such as "pbcs/Maze-v0". Packages that announce environments through
            the entry point group `pbcs_ompl.envs` are imported first; "module:id" imports `module` too.
        env_kwargs: Options of the environment.

    Raises:
        UnknownName: no such id.
        InvalidOption: an option that the environment does not have, or a value that it refuses.
        MissingDependency: the environment needs a library that is not installed.
        NoResetAnywhere, UnsupportedSpace: see `adapt`.
    """
    load_environments()
    kwargs = dict(env_kwargs or {})
    spec = _find(env_id)
    try:
        _check_options(spec, kwargs)
        env = gymnasium.make(env_id, **kwargs)
    except (gymnasium.error.DependencyNotInstalled, ModuleNotFoundError) as error:
        raise MissingDependency(f"environment {env_id!r} needs what is not installed: {error}") from error
    except (TypeError, ValueError) as error:
        raise InvalidOption(f"{env_id} refuses its options {kwargs}: {error}") from error
    model = adapt(env)
    model.env_id = env_id  # with its module, if it names one
    return model


def _find(env_id: str) -> EnvSpec:
    module, _, name = env_id.rpartition(":")
    try:
        if module:
            import_module(module)
        return gymnasium.spec(name)
    except ModuleNotFoundError as error:
        raise MissingDependency(f"environment {env_id!r}: there is no module {error.name!r}") from error
    except gymnasium.error.Error as error:
        raise UnknownName("environment", env_id, _choices(name)) from error


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
