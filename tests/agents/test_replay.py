"""Laws of the replay buffer, against a list for each seed."""

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.agents.replay import Replay

CPU = torch.device("cpu")


def ring(seeds: tuple[int, ...], capacity: int) -> Replay:
    return Replay(1, 1, seeds=seeds, capacity=capacity, device=CPU)


def add(replay: Replay, numbers: np.ndarray, mask: np.ndarray | None = None) -> None:
    """Append transitions that differ in their reward."""
    column = numbers[..., None]
    replay.add(column, -column, numbers, column + 0.5, np.zeros_like(numbers), mask)


def contents(replay: Replay, seed: int) -> list[float]:
    return sorted(replay.state_dict()["rows"][seed, : replay.sizes[seed], 2].tolist())


MASK = st.lists(st.tuples(st.booleans(), st.booleans()), max_size=9)


@given(capacity=st.integers(1, 12), masks=st.lists(MASK))
@settings(max_examples=100, deadline=None)
def test_every_ring_holds_the_last_transitions_of_its_seed(capacity: int, masks: list) -> None:
    replay, lists, number = ring((0, 1), capacity), ([], []), 0.0
    for mask in masks:
        chosen = np.array(mask, dtype=bool).reshape(-1, 2).T
        numbers = number + np.arange(chosen.size, dtype=float).reshape(chosen.shape)
        number += chosen.size
        add(replay, numbers, chosen)
        for seed in range(2):
            lists[seed].extend(numbers[seed][chosen[seed]].tolist())
    for seed in range(2):
        assert contents(replay, seed) == sorted(lists[seed][-capacity:])


def test_growth_keeps_what_is_there() -> None:
    replay = ring((0,), 20_000)
    for first in range(0, 12_000, 1500):
        add(replay, np.arange(first, first + 1500, dtype=float)[None])
    assert contents(replay, 0) == list(range(12_000))


def test_draws_do_not_depend_on_the_stack_or_on_how_many_are_made_at_once() -> None:
    numbers = np.random.default_rng(0).random((3, 500))
    stack, alone = ring((5, 6, 7), 1000), ring((6,), 1000)
    add(stack, numbers)
    add(alone, numbers[1:2])
    together = stack.sample(10, 32)
    apart = torch.cat([alone.sample(count, 32) for count in (1, 4, 5)])
    assert torch.equal(together[:, 1], apart[:, 0])


def test_draws_are_uniform_and_differ_between_seeds() -> None:
    replay = ring((0, 1), 100)
    add(replay, np.tile(np.arange(50.0), (2, 1)))
    drawn = replay.sample(100, 100)[..., 2].numpy()
    for seed in range(2):
        counts = np.bincount(drawn[:, seed].ravel().astype(int), minlength=50)
        assert np.square(counts - 200).sum() / 200 < 100  # chi-squared with 49 degrees of freedom: p < 1e-4
    assert not np.array_equal(drawn[:, 0], drawn[:, 1])


def test_fields_come_back_where_they_belong() -> None:
    replay = Replay(2, 1, seeds=(0,), capacity=10, device=CPU)
    replay.add(np.array([[[1.0, 2.0]]]), np.array([[[3.0]]]), np.array([[4.0]]), np.array([[[5.0, 6.0]]]),
               np.array([[1.0]]))
    batch = replay.unpack(replay.sample(1, 1)[0])
    assert batch.observations.tolist() == [[[1.0, 2.0]]]
    assert batch.obs_actions.tolist() == [[[1.0, 2.0, 3.0]]]
    assert (batch.rewards.item(), batch.not_done.item()) == (4.0, 0.0)
    assert batch.next_observations.tolist() == [[[5.0, 6.0]]]


def test_saved_and_loaded_rings_draw_the_same() -> None:
    first, second = ring((3, 4), 7), ring((3, 4), 7)
    add(first, np.arange(22.0).reshape(2, 11))
    first.sample(3, 5)
    second.load_state_dict(first.state_dict())
    assert torch.equal(first.sample(2, 5), second.sample(2, 5))
    for replay in (first, second):
        add(replay, np.array([[90.0], [91.0]]))
    assert torch.equal(first.sample(4, 9), second.sample(4, 9))
