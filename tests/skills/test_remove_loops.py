"""Loops are erased along the path with the fewest hops: compared with a breadth-first search."""

from collections import deque

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.resettable import make
from pbcs_ompl.skills.waypoints import remove_loops

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
def test_the_path_has_the_fewest_hops(steps, gap):
    states = np.cumsum(np.array([(1.0, 1.0), *steps]), axis=0)
    path = remove_loops(MODEL, states, gap)
    assert path[0] == 0
    assert path[-1] == len(states) - 1
    assert (np.diff(path) > 0).all()
    hops = np.linalg.norm(np.diff(states[path], axis=0), axis=1)
    assert ((hops <= gap) | (np.diff(path) == 1)).all()
    assert len(path) - 1 == fewest_hops(states, gap)


def test_a_loop_is_left_out():
    states = np.array([[0.5, 0.5], [0.6, 0.5], [0.7, 0.5], [0.7, 0.6], [0.6, 0.6], [0.6, 0.5], [0.5, 0.4]])
    assert remove_loops(MODEL, states, 0.12).tolist() == [0, 6]
    assert remove_loops(MODEL, states, 0.05).tolist() == [0, 1, 5, 6]
