"""What the numbers of an observation are, for whoever uses a controller without the toolkit."""

from typing import Any

import gymnasium
from gymnasium import spaces

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.resettable.fresh import close
from pbcs_ompl.resettable.observations import flat_size
from pbcs_ompl.resettable.task import task_of


def entry_names(environment: EnvSpec, size: int) -> list[str]:
    """Return the names of the entries of an observation as one vector [O]: "obs[0]", or "achieved_goal[0]" of a dict.

    Args:
        environment: The task; where it cannot be made here, the entries are numbered.
        size: O.
    """
    numbered = [f"obs[{index}]" for index in range(size)]
    try:
        make_env = task_of(environment).make_env
        if make_env is None:
            return numbered
        env = make_env()
    except PbcsError:
        return numbered
    names = _names(env.observation_space, "")
    close(env)
    return names if len(names) == size else numbered


def _names(space: gymnasium.Space[Any], prefix: str) -> list[str]:
    if isinstance(space, spaces.Dict):
        return [name for key in sorted(space.spaces) for name in
                _names(space.spaces[key], f"{prefix}.{key}" if prefix else key)]
    if isinstance(space, spaces.Tuple):
        return [name for index, part in enumerate(space.spaces) for name in
                _names(part, f"{prefix}.{index}" if prefix else f"part{index}")]
    return [f"{prefix or 'obs'}[{index}]" for index in range(flat_size(space))]
