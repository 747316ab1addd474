"""Plan on AntMaze until the goal or the budget's end: [Matheron2020] Fig. 3.9."""

from typing import Any

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make

ENV = "pbcs/AntMaze-v0"
PICTURED_SEED = 0


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed and planner, seed after seed, so that a study that was stopped is balanced."""
    return [{"name": f"{planner}-{seed}", "planner": planner, "seed": seed, "env_kwargs": sweep["env_kwargs"],
             "max_transitions": sweep["max_transitions"]}
            for seed in range(seeds) for planner, most in sweep["planners"].items() if seed < most]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Search; for one seed, count the nodes in each bin."""
    model = make(ENV, settings["env_kwargs"])
    found = plan(model, settings["planner"], seed=settings["seed"], max_transitions=settings["max_transitions"])
    record = {**settings, **found.summary()}
    if settings["seed"] == PICTURED_SEED:
        record["counts"] = bin_counts(model, found.tree.states).tolist()
    return record


def bin_counts(model: ResettableModel, states: Array) -> Array:
    """Return the number of nodes in each bin of the maze [X, Y]."""
    low, high = model.feature_low, model.feature_high
    x, y = model.feature(states).T
    shape = np.round((high - low) / model.bin_size).astype(int)
    counts, *_ = np.histogram2d(x, y, bins=shape, range=np.array([low, high]).T)
    return counts.astype(int)
