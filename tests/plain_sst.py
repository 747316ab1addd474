"""SST in plain Python, as slow as it is short: what its kernel is held to."""

import numpy as np

from pbcs_ompl.planners.planner import Strategy


class PlainSST(Strategy):
    """Li, Littlefield and Bekris 2016, with distances of features in bins and steps as costs."""

    continues = True

    def __init__(self, selection: float = 3.0, pruning: float = 1.0, beside_path: float = 0.0, on_surface: float = 0.0):
        self.selection, self.pruning, self.beside_path, self.on_surface = selection, pruning, beside_path, on_surface

    def start(self, context, rng):
        super().start(context, rng)
        self.low, self.high = context.feature_low / context.bin_size, context.feature_high / context.bin_size
        self.witnesses: list[np.ndarray] = []
        self.nodes: list[int] = []  # what each witness stands for
        self.path: list[int] = []

    def reached(self, tree, node):
        self.path = tree.path_to(node).tolist()

    @property
    def bound(self):
        return len(self.path) - 1 if self.path else 10**9

    def cost(self, tree, node):
        return len(tree.path_to(node)) - 1

    def select(self, tree, count):
        assert count == 1
        if self.path and self.beside_path and self.rng.random() < self.beside_path:
            node = self.path[int(self.rng.random() * len(self.path))]
            random = 2.0 * self.rng.random(len(self.low)) - 1.0
            target = tree.features[node] / self.context.bin_size + self.selection * random
        else:
            target = self.low + (self.high - self.low) * self.rng.random(len(self.low))
        away = np.linalg.norm(np.array(self.witnesses) - target, axis=1)
        costs = np.array([self.cost(tree, node) for node in self.nodes])
        away[costs + 1 >= self.bound] = np.inf
        near = np.flatnonzero(away <= self.selection)
        chosen = near[costs[near].argmin()] if len(near) else away.argmin()
        self.rest = self.bound - 1 - costs[chosen]
        return np.array([self.nodes[chosen]])

    def controls(self, tree, nodes):
        drawn = super().controls(tree, nodes)
        if self.on_surface and self.rng.random() < self.on_surface:  # the bounds are alike on both sides of 0
            drawn /= np.abs(drawn / self.context.action_high).max()
        return drawn

    def durations(self, tree, nodes):
        return np.minimum(super().durations(tree, nodes), self.rest)

    def inserted(self, tree, first, last):
        node = last - 1
        if tree.terminal[node] or self.cost(tree, node) >= self.bound:
            return
        point = tree.features[node] / self.context.bin_size
        away = [np.linalg.norm(point - witness) for witness in self.witnesses]
        if not away or min(away) > self.pruning:
            self.witnesses.append(point)
            self.nodes.append(node)
        elif self.cost(tree, node) < self.cost(tree, self.nodes[int(np.argmin(away))]):
            self.nodes[int(np.argmin(away))] = node
