"""The environments of the thesis, registered with Gymnasium as `pbcs/...` when this package is imported.

Importing is light: the entry points are strings, so that numba and FCL are loaded by `gymnasium.make` only.
"""

import gymnasium

ENTRY_POINTS = {
    "pbcs/Maze-v0": "envs.maze.maze:MazeEnv",
    "pbcs/Box-v0": "envs.box_disc:BoxEnv",
    "pbcs/Disc-v0": "envs.box_disc:DiscEnv",
}

for _env_id, _entry_point in ENTRY_POINTS.items():
    if _env_id not in gymnasium.registry:
        gymnasium.register(_env_id, entry_point=_entry_point, max_episode_steps=1000)
