"""Trees that do not stop at a goal, and the first path to it: [Matheron2020] Figs. 3.2-3.4, 4.2 and 4.3."""

from typing import Any

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.contracts import Array, ResetAnywhere
from pbcs_ompl.reset_anywhere import make
from pbcs_ompl.skills.exploration import without_goal

PICTURED_SEED = 0


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each scene, planner and seed."""
    return [{"name": f"{scene}-{planner}-{seed}", "scene": scene, "planner": planner, "seed": seed,
             "cell": sweep["cell"], **options}
            for scene, options in sweep["scenes"].items() for planner in sweep["planners"] for seed in range(seeds)]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Explore without a goal, and search for it where there is one."""
    model = make(settings["env"], settings.get("env_kwargs", {}))
    planner, seed = settings["planner"], settings["seed"]
    tree = plan(without_goal(model), planner, seed=seed, max_transitions=settings["transitions"]).tree
    counts = cell_counts(model, tree.states, settings["cell"])
    record = {**settings, "nodes": len(tree.states), "coverage": float((counts > 0).mean()),
              "evenness": evenness(counts)}
    if seed == PICTURED_SEED:
        record |= {"states": tree.states.tolist(), "parents": tree.parents.tolist()}
    if model.goal_circle is not None:
        found = plan(model, planner, seed=seed, max_transitions=100_000)
        path = None if found.trajectory is None else found.trajectory.states
        record |= {"first_reward": found.transitions if found.solved else None, "path_length": found.path_length}
        if seed == PICTURED_SEED and path is not None:
            record |= {"found_states": found.tree.states.tolist(), "found_parents": found.tree.parents.tolist(),
                       "path": path.tolist()}
    return record


def cell_counts(model: ResetAnywhere, states: Array, cell: float) -> Array:
    """Return the number of states in each square cell whose centre can be reached."""
    low, high = model.state_low, model.state_high
    shape = np.round((high - low) / cell).astype(int)
    index = np.minimum(((states - low) / cell).astype(int), shape - 1)
    counts = np.zeros(shape)
    np.add.at(counts, tuple(index.T), 1)
    centres = low + cell * (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) + 0.5)
    return counts[model.is_valid(centres.reshape(-1, len(low))).reshape(shape)]


def evenness(counts: Array) -> float:
    """Return the entropy of the counts over the cells, as a share of the largest possible: 1 is uniform, 0 one cell."""
    shares = counts[counts > 0] / counts.sum()
    return float(-(shares * np.log(shares)).sum() / np.log(len(counts)))
