"""Choose the adapter for an environment."""

from typing import Any, cast

import gymnasium

from pbcs_ompl.core.contracts import ResetAnywhere, VectorisedEnv
from pbcs_ompl.core.errors import NoResetAnywhere
from pbcs_ompl.reset_anywhere.get_set_state import GetSetStateModel, offers_get_set_state
from pbcs_ompl.reset_anywhere.spaces import check_spaces
from pbcs_ompl.reset_anywhere.vectorised import VectorisedModel
from pbcs_ompl.reset_anywhere.wrappers import unwrap

HOW_TO = (
    "implement `get_env_state() -> array [D]` and `set_env_state(array)` beside `step` (simple), or the "
    "protocol `pbcs_ompl.core.contracts.VectorisedEnv` (fast)"
)
MODEL_MEMBERS = {*ResetAnywhere.__annotations__, *(n for n in vars(ResetAnywhere) if not n.startswith("_"))}


def adapt(env: Any) -> ResetAnywhere:
    """Return `env` as a `ResetAnywhere`; a model that is already adapted is returned as it is.

    The model works on `env.unwrapped` and moves it about: give it an environment of its own.

    Raises:
        NoResetAnywhere: its states cannot be restored, or a wrapper would be lost; says what to implement.
        UnsupportedSpace: its actions are no finite vector Box, or its observations no vector Box.
    """
    if not isinstance(env, gymnasium.Env):
        return _as_model(env)
    inner = unwrap(env)
    check_spaces(inner)
    if isinstance(inner, VectorisedEnv):
        return VectorisedModel(inner)
    if offers_get_set_state(inner):
        return GetSetStateModel(inner)
    raise NoResetAnywhere(f"{_name(inner)} cannot be reset anywhere: {HOW_TO}")


def _as_model(model: Any) -> ResetAnywhere:
    missing = sorted(name for name in MODEL_MEMBERS if not hasattr(model, name))
    if isinstance(model, str):
        raise NoResetAnywhere(f"expected a gymnasium.Env, got the string {model!r}; call make({model!r})")
    if len(missing) == len(MODEL_MEMBERS):
        raise NoResetAnywhere(f"expected a gymnasium.Env or a ResetAnywhere, got {type(model).__name__}")
    if missing:
        raise NoResetAnywhere(f"{type(model).__name__} is no ResetAnywhere; it lacks {', '.join(missing)}")
    return cast(ResetAnywhere, model)


def _name(env: gymnasium.Env) -> str:
    return env.spec.id if env.spec is not None else type(env).__name__
