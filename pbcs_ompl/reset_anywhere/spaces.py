"""Which observation and action spaces the toolkit can work with: vectors."""

import gymnasium
import numpy as np
from gymnasium import spaces

from pbcs_ompl.core.errors import UnsupportedSpace


def check_spaces(env: gymnasium.Env) -> None:
    """Refuse an environment whose actions are not a finite vector Box or whose observations are not a vector Box.

    Raises:
        UnsupportedSpace: says the remedy.
    """
    action, observation = env.action_space, env.observation_space
    if not isinstance(action, spaces.Box):
        raise UnsupportedSpace(f"action space {action}: expected a Box; planners need continuous controls, so map a "
                               f"Box to these actions inside of the environment")
    if len(action.shape) != 1:
        raise UnsupportedSpace(f"action space of shape {action.shape}: expected a vector; reshape it inside of the "
                               f"environment")
    if not (np.isfinite(action.low).all() and np.isfinite(action.high).all()):
        raise UnsupportedSpace(f"action space {action}: expected finite bounds; planners sample actions uniformly, so "
                               f"give the Box finite low and high")
    if isinstance(observation, spaces.Dict | spaces.Tuple):
        raise UnsupportedSpace(f"observation space {type(observation).__name__}: expected a vector Box; return the "
                               f"parts as one vector (gymnasium.spaces.flatten) inside of the environment")
    if not isinstance(observation, spaces.Box) or len(observation.shape) != 1:
        raise UnsupportedSpace(f"observation space {observation}: expected a vector Box")
