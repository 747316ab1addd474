"""How do I plug in a planner of my own? As a strategy of a few lines, or as any `ompl.base.Planner`.

    python examples/own_planner.py
    pbcs plan --env pbcs/Maze-v0 --planner examples.own_planner:Emptiest --planner-kwargs '{"candidates": 20}'

A name of its own for `--planner` is declared in your package's pyproject.toml:

    [project.entry-points."pbcs_ompl.planners"]
    Emptiest = "my_package.my_module:Emptiest"
"""

import random
from collections import Counter
from itertools import pairwise

import numpy as np
from ompl import base as ob
from ompl import control as oc

import pbcs_ompl
from pbcs_ompl.planners import Strategy


class Emptiest(Strategy):
    """Draw some nodes at random and expand the one whose bin was expanded least often."""

    def __init__(self, candidates: int = 10):
        self.candidates = candidates

    def start(self, context, rng):
        super().start(context, rng)
        self.bins, self.expansions = [], Counter()  # the bin of each node, the expansions of each bin

    def inserted(self, tree, first, last):
        self.bins += map(tuple, np.floor(tree.features[first:last] / self.context.bin_size).tolist())

    def select(self, tree, count):
        return np.array([self.select_one(tree) for _ in range(count)])

    def select_one(self, tree):
        drawn = self.rng.integers(len(tree), size=self.candidates)
        expandable = [*drawn[~tree.terminal[drawn]], 0]  # node 0 is the start, which is never terminal
        best = min(expandable, key=lambda node: self.expansions[self.bins[node]])
        self.expansions[self.bins[best]] += 1
        return best


class Nearest(ob.Planner):
    """A plain OMPL planner that knows nothing of this project: extend the node nearest to a sample."""

    def __init__(self, si, seed=0):
        super().__init__(si, "Nearest")
        self.random = random.Random(seed)

    def solve(self, ptc):
        si, problem = self.getSpaceInformation(), self.getProblemDefinition()
        bounds, sampler = si.getControlSpace().getBounds(), si.allocStateSampler()
        start, sample, buffer = si.allocState(), si.allocState(), si.allocControl()
        si.copyState(start, self.getPlannerInputStates().nextStart())
        tree = [(start, None, None)]  # state, index of the parent, control
        while not ptc():
            sampler.sampleUniform(sample)
            parent = min(range(len(tree)), key=lambda node: si.distance(tree[node][0], sample))
            control = [self.random.uniform(*limits) for limits in zip(bounds.low, bounds.high, strict=True)]
            state = si.allocState()
            if si.propagateWhileValid(tree[parent][0], fill(buffer, control), 1, state) == 1:
                tree.append((state, parent, control))
                if problem.getGoal().isSatisfied(state):
                    problem.addSolutionPath(path_to_last(si, tree, buffer))
                    return ob.PlannerStatus(ob.PlannerStatus.EXACT_SOLUTION)
        return ob.PlannerStatus(ob.PlannerStatus.TIMEOUT)


def path_to_last(si, tree, buffer):
    steps, node = [], len(tree) - 1
    while node is not None:
        steps.insert(0, tree[node])
        node = tree[node][1]
    path = oc.PathControl(si)
    for (state, _, _), (_, _, control) in pairwise(steps):
        path.append(state, fill(buffer, control), si.getPropagationStepSize())
    path.append(steps[-1][0])
    return path


def fill(buffer, numbers):
    buffer[0], buffer[1] = numbers
    return buffer


def main() -> None:
    for planner in (Emptiest, Nearest):
        result = pbcs_ompl.plan("pbcs/Maze-v0", planner, env_kwargs={"size": 2}, seed=0)
        print(f"{planner.__name__}: solved {result.solved}, {result.transitions:,} transitions, "
              f"replays exactly: {result.replay_ok}")


if __name__ == "__main__":
    main()
