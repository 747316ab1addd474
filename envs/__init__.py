"""The environments of the thesis, a car and a quadrotor: registered as `pbcs/...` when this package is imported.

Importing is light: the entry points are strings, so that numba, FCL and MuJoCo are loaded by `gymnasium.make` only.
"""

import gymnasium

ENTRY_POINTS = {
    "pbcs/Maze-v0": "pbcs_ompl.envs.maze.maze:MazeEnv",
    "pbcs/Box-v0": "pbcs_ompl.envs.box_disc:BoxEnv",
    "pbcs/Disc-v0": "pbcs_ompl.envs.box_disc:DiscEnv",
    "pbcs/Toy1D-v0": "pbcs_ompl.envs.line_env:Toy1DEnv",
    "pbcs/Drift-v0": "pbcs_ompl.envs.line_env:DriftEnv",
    "pbcs/CarPark-v0": "pbcs_ompl.envs.car_park:CarParkEnv",
    "pbcs/PlanarQuadrotor-v0": "pbcs_ompl.envs.planar_quadrotor:PlanarQuadrotorEnv",
    "pbcs/AntMaze-v0": "pbcs_ompl.envs.ant_maze:AntMazeEnv",
    "pbcs/SparseHalfCheetah-v0": "pbcs_ompl.envs.sparse_half_cheetah:SparseHalfCheetahEnv",
}

EPISODE_STEPS = {"pbcs/Toy1D-v0": 50, "pbcs/Drift-v0": 50, "pbcs/SparseHalfCheetah-v0": 1000}
"""Limits of episodes. Mazes, box, disc and ant have none, as in the thesis; their class suggests a length."""

for _env_id, _entry_point in ENTRY_POINTS.items():
    if _env_id not in gymnasium.registry:
        gymnasium.register(_env_id, entry_point=_entry_point, max_episode_steps=EPISODE_STEPS.get(_env_id))

if __name__ == "envs":  # the folder of a checkout, imported by its own name
    from pbcs_ompl.core.alias import alias_package

    alias_package("envs", "pbcs_ompl.envs")
