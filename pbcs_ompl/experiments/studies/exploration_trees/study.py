"""Trees that do not stop at a goal, and the first path to it: [Matheron2020] Figs. 3.2-3.4, 4.2 and 4.3."""

from typing import Any

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.without_goal import without_goal

PICTURED_SEED = 0
SAMPLES = 8
"""Points along each edge of a cell, by which the share of it that can be reached is estimated."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each scene, planner and seed."""
    return [{"name": f"{scene}-{planner}-{seed}", "scene": scene, "planner": planner, "seed": seed,
             "cell": sweep["cell"], "circle": sweep["circle"], **options}
            for scene, options in sweep["scenes"].items() for planner in sweep["planners"] for seed in range(seeds)]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Explore without a goal, and search for it where there is one."""
    model = make(settings["env"], settings.get("env_kwargs", {}))
    planner, seed = settings["planner"], settings["seed"]
    tree = plan(without_goal(model), planner, planner_kwargs={"batch": 1}, seed=seed,
                max_transitions=settings["transitions"]).tree
    counts, areas = cells(model, tree.states, settings["cell"])
    record = {**settings, "nodes": len(tree.states), "coverage": coverage(counts, areas),
              "evenness": evenness(counts, areas), "density": density(tree.states, settings["circle"])}
    if seed == PICTURED_SEED:
        record |= {"states": tree.states.tolist(), "parents": tree.parents.tolist()}
    if model.goal_circle is not None:
        found = plan(model, planner, seed=seed, max_transitions=100_000)
        path = None if found.trajectory is None else found.trajectory.states
        record |= {"first_reward": found.transitions if found.solved else None, "path_length": found.path_length,
                   "fewest_steps": fewest_steps(model)}
        if seed == PICTURED_SEED and path is not None:
            record |= {"found_states": found.tree.states.tolist(), "found_parents": found.tree.parents.tolist(),
                       "path": path.tolist()}
    return record


def fewest_steps(model: ResettableModel, spacing: float = 0.025) -> int | None:
    """Return the fewest steps from the start to the goal, by breadth-first search over a lattice; None for no way.

    Moves are all displacements within the action box that lead from a point of the lattice to another one, so the true
    number is at most this one.

    Args:
        model: A maze: a point that moves by its action.
        spacing: Of the lattice.
    """
    reach = round(float(model.action_high[0]) / spacing)
    line = np.arange(-reach, reach + 1, dtype=np.float64) * spacing
    moves = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    start = model.initial_state(0)
    front, seen = start[None], {(0, 0)}
    for step in range(1, model.max_episode_steps + 1):
        states, controls = np.repeat(front, len(moves), axis=0), np.tile(moves, (len(front), 1))
        outcome = model.transition(states, controls)
        if outcome.success.any():
            return step
        moved = np.abs(outcome.states - states - controls).max(axis=1) < 1e-9
        keys = np.unique(np.round((outcome.states[moved] - start) / spacing).astype(np.int64), axis=0)
        new = [key for key in map(tuple, keys.tolist()) if key not in seen]
        if not new:
            return None
        seen.update(new)
        front = start + spacing * np.array(new)
    return None


def cells(model: ResettableModel, states: Array, cell: float) -> tuple[Array, Array]:
    """Return, for each square cell, the number of states in it and how much of it can be reached, in [0, 1]."""
    low, high = model.state_low, model.state_high
    shape = np.round((high - low) / cell).astype(int)
    index = np.minimum(((states - low) / cell).astype(int), shape - 1)
    counts = np.zeros(shape)
    np.add.at(counts, tuple(index.T), 1)
    edges = np.meshgrid(*((np.arange(count * SAMPLES) + 0.5) / SAMPLES * cell for count in shape), indexing="ij")
    valid = model.is_valid(low + np.stack(edges, axis=-1).reshape(-1, len(low)))
    areas = valid.reshape(shape[0], SAMPLES, shape[1], SAMPLES).mean(axis=(1, 3))
    return counts.ravel(), areas.ravel()


def evenness(counts: Array, areas: Array) -> float:
    """Return how evenly a tree fills what can be reached: exp(-KL(p, q)), 1 when it is uniform.

    p is the share of the states in each cell, q that of the reachable area. A tree that is uniform over a part of the
    area, and nowhere else, has the evenness of that part's share. States in cells that count as unreachable, for a
    corner of them is reachable that no sample met, are left out.
    """
    counted = (counts > 0) & (areas > 0)
    p, q = counts[counted] / counts[counted].sum(), areas[counted] / areas.sum()
    return float(np.exp(-(p * np.log(p / q)).sum()))


def coverage(counts: Array, areas: Array) -> float:
    """Return the share of the cells that can be reached to at least a half in which there is a state."""
    return float((counts > 0)[areas >= 0.5].mean())


def density(states: Array, circle: tuple[float, float, float]) -> float:
    """Return the number of states in a circle (x, y, radius) for each unit of its area."""
    x, y, radius = circle
    return float((np.hypot(*(states - (x, y)).T) <= radius).sum() / (np.pi * radius**2))
