"""Execute trajectories by a loop over Gymnasium's interface, in a process that has planned nothing.

Arguments: folder, task as JSON. Prints for how many the environment granted the goal, and which it did not.
"""

import json
import sys
import warnings
from importlib import import_module
from pathlib import Path

import gymnasium
import numpy as np


def granted(task: dict[str, object], path: Path) -> bool:
    """Return whether a fresh environment grants the goal to the actions of a file."""
    with np.load(path, allow_pickle=False) as file:
        actions, words = file["actions"], json.loads(str(file["metadata"]))
    env = gymnasium.make(task["id"], **task.get("kwargs", {}))
    observation, info = env.reset(seed=words["reset_seed"])
    reward, terminated, truncated = 0.0, False, False
    for action in (None, *actions):
        if action is not None:
            assert action in env.action_space
            observation, reward, terminated, truncated, info = env.step(action)
        if task.get("check"):
            names = {"obs": observation, "qpos": getattr(getattr(env.unwrapped, "data", None), "qpos", None)}
            reached = CHECKS[task["check"]](names)
        else:
            reached = bool(info.get("is_success", info.get("success", terminated and reward > 0)))
        if reached:
            return True
        if terminated or truncated:
            return False
    return False


CHECKS = {
    "obs0>-0.3": lambda names: names["obs"][0] > -0.3,
    "obs0>0.2": lambda names: names["obs"][0] > 0.2,
    "obs0<0": lambda names: names["obs"][0] < 0.0,
    "qpos0>0.05": lambda names: names["qpos"][0] > 0.05,
}


def main(folder: Path, task: dict[str, object]) -> None:
    warnings.simplefilter("ignore")
    for module in ("pbcs_ompl.envs", *task.get("modules", ())):
        import_module(module)
    files = sorted(folder.glob("*.npz"))
    refused = [file.name for file in files if not granted(task, file)]
    print(json.dumps({"executed": len(files), "refused": refused}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.loads(sys.argv[2]))
