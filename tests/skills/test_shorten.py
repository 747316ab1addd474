"""Detours are erased along the shortest way: compared with a breadth-first search."""

from collections import deque

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.resettable import make
from pbcs_ompl.skills.shorten import shorten

MODEL = make("pbcs/Maze-v0", {"size": 2})
walks = st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)), min_size=1, max_size=40)


def fewest_hops(states, gap):
    """Breadth-first search over the same graph: i -> i + 1, and i -> j > i within the gap."""
    hops, queue = {0: 0}, deque([0])
    while queue:
        i = queue.popleft()
        for j in range(i + 1, len(states)):
            if (j == i + 1 or np.linalg.norm(states[j] - states[i]) <= gap) and j not in hops:
                hops[j] = hops[i] + 1
                queue.append(j)
    return hops[len(states) - 1]


@given(walks, st.floats(0.01, 0.3))
@settings(max_examples=60, deadline=None)
def test_the_way_is_the_shortest(steps, gap):
    states = np.cumsum(np.array([(1.0, 1.0), *steps]), axis=0)
    way = shorten(MODEL, states, gap)
    assert way[0] == 0
    assert way[-1] == len(states) - 1
    assert (np.diff(way) > 0).all()
    hops = np.linalg.norm(np.diff(states[way], axis=0), axis=1)
    assert ((hops <= gap) | (np.diff(way) == 1)).all()
    assert len(way) - 1 == fewest_hops(states, gap)


def test_a_loop_is_left_out():
    states = np.array([[0.5, 0.5], [0.6, 0.5], [0.7, 0.5], [0.7, 0.6], [0.6, 0.6], [0.6, 0.5], [0.5, 0.4]])
    assert shorten(MODEL, states, 0.12).tolist() == [0, 6]
    assert shorten(MODEL, states, 0.05).tolist() == [0, 1, 5, 6]
