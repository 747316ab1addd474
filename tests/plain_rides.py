"""Rides written down plainly, with dictionaries and lists: what the kernels are held to, bit for bit."""

from collections import defaultdict

import numpy as np


class Region:
    def __init__(self, features):
        self.count, self.missing, self.parent, self.children, self.nodes = 0, 2 * features, None, [], []

    @property
    def key(self):
        return self.count if self.missing else 4 * (self.count + 1)


class Ranking:
    """Regions by key. Which one of equal keys comes first does not matter, but the kernels' order is this one."""

    def __init__(self):
        self.lists = defaultdict(list)

    def lift(self, region, old, new):
        below = self.lists[old]
        below[below.index(region)] = below[0]
        del below[0]
        if not below:
            del self.lists[old]
        for key in sorted(self.lists):
            if old < key < new:
                self.lists[key].append(self.lists[key].pop(0))
        self.lists[new].append(region)

    def draw(self, uniform):
        ties = self.lists[min(self.lists)]
        return ties[int(uniform * len(ties))]


class PlainRides:
    """One ride after the other: `next_step` says where to apply which control, `take_step` takes the result."""

    def __init__(self, features, bin_size, low, high, rng, longest, scales=5, known=2, still=True, kinds=(0, 1),
                 learns=("scale", "kind", "patience")):
        self.features, self.bin_size, self.low, self.high, self.rng = features, bin_size, low, high, rng
        self.longest, self.regions = longest, [{} for _ in range(scales)]
        self.rankings = [Ranking() for _ in range(scales)]
        self.opened = {"scale": np.ones(scales), "kind": np.ones(2), "patience": np.ones(6)}
        self.used = {question: np.ones(len(answers)) for question, answers in self.opened.items()}
        self.riding, self.most_known, self.still, self.kinds, self.learns = False, known, still, kinds, learns

    def choose(self, question):
        squared = (self.opened[question] / self.used[question]) ** 2
        weights = squared * squared
        if question == "kind":
            weights = np.where(np.isin((0, 1), self.kinds), weights, 0.0)
        rest = self.rng.random() * sum(weights.tolist())
        for answer, weight in enumerate(weights[:-1].tolist()):
            rest -= weight
            if rest < 0.0:
                return answer
        return len(weights) - 1

    def next_step(self):
        if not self.riding:
            self.begin()
        return self.node, self.control

    def begin(self):
        self.chosen = {question: self.choose(question) for question in self.opened}
        region = self.rankings[self.chosen["scale"]].draw(self.rng.random())
        while region.children:
            least = min(child.key for child in region.children)
            ties = [child for child in region.children if child.key == least]
            region = ties[int(self.rng.random() * len(ties))]
        self.bin = region
        self.node = region.nodes[int(self.rng.random() * len(region.nodes))]
        for ranking in self.rankings:
            old = region.key
            region.count += 1
            ranking.lift(region, old, region.key)
            region = region.parent
        unit = np.array([2.0 * self.rng.random() - 1.0 for _ in self.low])
        if self.chosen["kind"] == 1:
            unit /= np.abs(unit).max()
        self.control = np.clip((self.low + self.high) / 2.0 + (self.high - self.low) / 2.0 * unit, self.low, self.high)
        self.riding, self.steps, self.dry, self.known, self.gains = True, 0, 0, 0, 0

    def bin_of(self, feature):
        """Return the bin of a feature, and whether it is new; then it and the new regions around it are opened."""
        cell = tuple(np.floor(feature / self.bin_size).astype(int).tolist())
        if cell in self.regions[0]:
            return self.regions[0][cell], False
        inner = opened = None
        for regions, ranking in zip(self.regions, self.rankings, strict=True):
            region, known = regions.get(cell), cell in regions
            if not known:
                region = regions[cell] = Region(self.features)
                ranking.lists[0].append(region)
                self.meet_neighbours(regions, ranking, cell, region)
            opened = opened or region
            if inner is not None:
                inner.parent = region
                region.children.insert(0, inner)
            if known:
                break
            inner, cell = region, tuple(coordinate // 2 for coordinate in cell)
        return opened, True

    def meet_neighbours(self, regions, ranking, cell, region):
        for axis in range(self.features):
            for side in (-1, 1):
                other = regions.get((*cell[:axis], cell[axis] + side, *cell[axis + 1:]))
                if other is not None:
                    old = other.key
                    region.missing -= 1
                    other.missing -= 1
                    if not other.missing:
                        ranking.lift(other, old, other.key)
        if not region.missing:
            ranking.lift(region, 0, region.key)

    def root(self, node, feature):
        self.bin_of(feature)[0].nodes.append(node)

    def take_step(self, node, feature, moved, terminal):
        self.steps += 1
        over = terminal
        if not terminal:
            region, opened = self.bin_of(feature)
            region.nodes.append(node)
            self.gains += opened
            self.dry = 0 if opened else self.dry + 1
            self.known = 0 if opened else self.known + (region is not self.bin)
            self.node, self.bin = node, region
            over = ((self.still and not moved) or self.known >= self.most_known
                    or self.dry >= 2 ** self.chosen["patience"] or self.steps >= self.longest)
        if over:
            self.riding = False
            for question, answer in self.chosen.items():
                if question not in self.learns:
                    continue
                self.opened[question][answer] += self.gains
                self.used[question][answer] += self.steps
