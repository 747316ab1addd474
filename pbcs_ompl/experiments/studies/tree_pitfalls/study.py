"""Pitfalls of exploration trees: the density paradox, unbalanced k-d trees, what an expansion costs in a large tree."""

import time
from typing import Any

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.without_goal import without_goal

BOX = "pbcs/Box-v0"
MEASURES = ("nodes nearby", "edges that leave nodes nearby")
"""Of the density around a node: what leads to the paradox, and that of Ex ([Matheron2020] 3.3.1, third approach)."""

EST_RULES = ("draw", "least")
"""Options of ESTAdapted: the rules of Fig. 3.5 and of the text of 3.2."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run of each kind for each seed."""
    kinds = [{"kind": "paradox", "measure": measure, **sweep["paradox"]} for measure in MEASURES]
    kinds += [{"kind": "neighbours", **sweep["neighbours"]}]
    kinds += [{"kind": "growth", "planner": planner, "sizes": sweep["growth"]["sizes"]}
              for planner in sweep["growth"]["planners"]]
    kinds += [{"kind": "est", "rule": rule, "size": size, "max_transitions": sweep["est"]["max_transitions"]}
              for size in sweep["est"]["sizes"] for rule in EST_RULES]
    return [{"name": f"{kind['kind']}-{index}-{seed}", "seed": seed, **kind}
            for seed in range(seeds) for index, kind in enumerate(kinds)]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Do what the kind of the run says."""
    rng = np.random.default_rng(settings["seed"])
    kinds = {"paradox": _paradox, "neighbours": _neighbours, "growth": _growth, "est": _est}
    return settings | kinds[settings["kind"]](settings, rng)


def _paradox(settings: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Expand the node of the lowest density again and again; return the share of expansions from the middle."""
    angles = 2.0 * np.pi * np.arange(settings["ring"]) / settings["ring"]
    nodes = np.concatenate([np.zeros((1, 2)), np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    children = np.zeros(len(nodes))
    children[0] = settings["ring"]
    middle = 0
    for _ in range(settings["expansions"]):
        near = np.linalg.norm(nodes[:, None] - nodes[None], axis=2) <= settings["radius"]
        density = near.sum(axis=1) if settings["measure"] == MEASURES[0] else near @ children
        chosen = int(rng.choice(np.flatnonzero(density == density.min())))
        middle += chosen == 0
        angle = rng.uniform(0.0, 2.0 * np.pi)
        nodes = np.concatenate([nodes, nodes[chosen] + [[np.cos(angle), np.sin(angle)]]])
        children[chosen] += 1
        children = np.append(children, 0.0)
    return {"from_the_middle": middle / settings["expansions"]}


def _neighbours(settings: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the mean depth of nodes in an unbalanced k-d tree of the first nodes, for each number of them."""
    model = without_goal(make(BOX))
    tree = plan(model, "RRTNH", seed=settings["seed"], max_transitions=max(settings["sizes"])).tree
    orders = {"of RRT-NH": tree.states, "random": rng.permutation(tree.states)}
    depths = {name: depths_in_kd_tree(np.ascontiguousarray(states)) for name, states in orders.items()}
    return {"depths": {name: [float(found[:size].mean()) for size in settings["sizes"]]
                       for name, found in depths.items()}}


@njit()
def depths_in_kd_tree(points: Array) -> Array:
    """Return the depth [N] at which each point [N, D] is inserted into a k-d tree that is never balanced."""
    count, dimensions = points.shape
    lower, upper = np.full(count, -1), np.full(count, -1)
    depths = np.zeros(count)
    for new in range(1, count):
        node, depth = 0, 0
        while True:
            axis = depth % dimensions
            sides = lower if points[new, axis] < points[node, axis] else upper
            depth += 1
            if sides[node] < 0:
                sides[node] = new
                break
            node = sides[node]
        depths[new] = depth
    return depths


def _growth(settings: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the processor's seconds of searches of several sizes."""
    model, spent = make(BOX), []
    plan(model, settings["planner"], seed=settings["seed"], max_transitions=settings["sizes"][0])  # compiles
    for size in settings["sizes"]:
        began = time.process_time()
        plan(model, settings["planner"], seed=settings["seed"], max_transitions=size)
        spent.append(time.process_time() - began)
    return {"seconds": spent}


def _est(settings: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return how many transitions EST needs in a maze with one of the two rules of [Matheron2020] 3.2."""
    size, seed = settings["size"], settings["seed"]
    maze = {"size": size} | ({"maze_seed": seed} if size > 3 else {})
    found = plan("pbcs/Maze-v0", "ESTAdapted", env_kwargs=maze, planner_kwargs={"rule": settings["rule"], "batch": 1},
                 seed=seed, max_transitions=settings["max_transitions"])
    return {"solved": found.solved, "transitions": found.transitions}
