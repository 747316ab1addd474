"""The bin queue is [Matheron2020] Alg. 5: against a plain transcription, and against brute force."""

from collections import defaultdict

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert, select, tied_bins


class Algorithm5:
    """Alg. 5 with dictionaries of lists. Removing an element puts the list's first one into the gap."""

    def __init__(self):
        self.w_b = defaultdict(list)
        self.b_s = defaultdict(lambda: defaultdict(list))
        self.b_m = {}
        self.m = 0

    def insert(self, b, s):
        if b not in self.b_m:
            self.m = 0
            self.w_b[0].append(b)
        self.b_s[b][0].append(s)
        self.b_m[b] = 0

    def select(self, for_bin, for_node):
        b = self._take(self.w_b[self.m], for_bin)
        self.w_b[self.m + 1].append(b)
        if not self.w_b[self.m]:
            self.m += 1
        m_b = self.b_m[b]
        s = self._take(self.b_s[b][m_b], for_node)
        self.b_s[b][m_b + 1].append(s)
        if not self.b_s[b][m_b]:
            self.b_m[b] = m_b + 1
        return s

    @staticmethod
    def _take(items, uniform):
        i = int(uniform * len(items))
        chosen = items[i]
        items[i] = items[0]
        items.pop(0)
        return chosen


def members_of(queue, members, head):
    """Return {member: count} of one least-count queue."""
    start, end, run, counts = head["start"], head["length"], head, {}
    while end > 0:
        counts.update(dict.fromkeys(members[start + run["first"]:start + end].tolist(), int(run["count"])))
        end, run = run["first"], queue.runs[run["higher"]]
    return counts


def counts_of(queue):
    """Return {cell: (bin count, {node: count})}."""
    return {tuple(queue.cells[number]): (count, members_of(queue, queue.pool, queue.heads[number]))
            for number, count in members_of(queue, queue.order, queue.head[0]).items()}


def grown(rng, operations, spread, features=2):
    """Yield (queue, Alg. 5, kernel's choice, its choice) while inserting around what was selected."""
    queue, plain, size = empty_queue(features), Algorithm5(), np.full(features, 0.5)
    points = np.zeros((operations + 1, features))
    nodes = np.empty(1, np.int64)
    for new in range(operations + 1):
        if new > 0:
            uniforms = rng.random((1, 2))
            queue = select(queue, uniforms, nodes)
            yield queue, plain, int(nodes[0]), plain.select(*uniforms[0])
            points[new] = points[nodes[0]] + rng.normal(0.0, spread, features)
        queue = insert(queue, points[new:new + 1], np.zeros(1, bool), size, new)
        plain.insert(tuple(np.floor(points[new] / size).astype(int).tolist()), new)


def test_choices_equal_alg_5_one_by_one():
    for seed, spread in ((0, 0.02), (1, 0.3), (2, 5.0)):
        for _, _, chosen, expected in grown(np.random.default_rng(seed), 4000, spread):
            assert chosen == expected


def test_more_features_and_negative_coordinates_equal_alg_5():
    for _, _, chosen, expected in grown(np.random.default_rng(3), 1500, 0.3, features=5):
        assert chosen == expected


def test_a_batch_of_selections_is_the_selections_one_by_one():
    rng = np.random.default_rng(4)
    points = rng.uniform(-3, 3, (500, 2))
    one, many = (insert(empty_queue(2), points, np.zeros(500, bool), np.ones(2), 0) for _ in range(2))
    uniforms, together, alone = rng.random((300, 2)), np.empty(300, np.int64), np.empty(1, np.int64)
    many = select(many, uniforms, together)
    for row in range(300):
        one = select(one, uniforms[row:row + 1], alone)
        assert alone[0] == together[row]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 120), st.sampled_from([0.05, 0.4, 3.0]))
def test_counters_by_brute_force(seed, operations, spread):
    """c_b is the sum of c_s; the selected bin has the least c_b, the selected node the least c_s in it."""
    rng, size, nodes = np.random.default_rng(seed), np.full(2, 0.5), np.empty(1, np.int64)
    points = np.zeros((operations + 1, 2))
    queue = insert(empty_queue(2), points[:1], np.zeros(1, bool), size, 0)
    for new in range(1, operations + 1):
        bins = counts_of(queue)
        least = min(count for count, _ in bins.values())
        assert all(count == sum(inside.values()) for count, inside in bins.values())
        assert tied_bins(queue) == sum(count == least for count, _ in bins.values())
        queue = select(queue, rng.random((1, 2)), nodes)
        chosen = int(nodes[0])
        count, inside = bins[tuple(np.floor(points[chosen] / size).astype(int).tolist())]
        assert count == least
        assert inside[chosen] == min(inside.values())
        points[new] = points[chosen] + rng.normal(0.0, spread, 2)
        queue = insert(queue, points[new:new + 1], np.zeros(1, bool), size, new)


def test_ties_are_broken_uniformly():
    """Of 5 tied bins with 3 tied nodes each, all nodes are first equally often (chi squared, p > 1e-4)."""
    points = np.repeat(np.arange(5.0), 3)[:, None] + 0.5
    rng, hits, nodes = np.random.default_rng(5), np.zeros(15), np.empty(1, np.int64)
    for _ in range(6000):
        queue = insert(empty_queue(1), points, np.zeros(15, bool), np.ones(1), 0)
        select(queue, rng.random((1, 2)), nodes)
        hits[nodes[0]] += 1
    assert ((hits - 400) ** 2 / 400).sum() < 42.6  # 14 degrees of freedom


def test_skipped_nodes_are_never_selected_and_open_no_bin():
    points = np.arange(20.0)[:, None]
    skip = np.arange(20) % 2 == 1
    queue = insert(empty_queue(1), points, skip, np.ones(1), 0)
    nodes = np.empty(200, np.int64)
    select(queue, np.random.default_rng(6).random((200, 2)), nodes)
    assert queue.num_bins == 10
    assert set(nodes.tolist()) == set(range(0, 20, 2))


def test_far_away_features_have_a_bin_too():
    queue = insert(empty_queue(1), np.array([[1e300], [-1e300], [0.0]]), np.zeros(3, bool), np.ones(1), 0)
    assert queue.num_bins == 3


def test_large_trees_keep_every_node_once():
    rng = np.random.default_rng(7)
    points = rng.normal(0, 30, (300_000, 2))
    queue = insert(empty_queue(2), points, np.zeros(len(points), bool), np.ones(2), 0)
    heads = queue.heads[:queue.num_bins]
    members = [queue.pool[head["start"]:head["start"] + head["length"]] for head in heads]
    assert np.array_equal(np.sort(np.concatenate(members)), np.arange(len(points)))
    assert queue.num_bins == len(np.unique(np.floor(points), axis=0))
