"""Laws of the streams: a number depends on its key and its position only, and has the distribution it should have."""

import numpy as np
import pytest
from scipy.stats import kstest

from pbcs_ompl.agents.kernels.counter_rng import normal, stream_keys, uniform


@pytest.mark.parametrize("draw", [uniform, normal])
def test_draws_do_not_depend_on_how_many_are_made_at_once_or_beside_them(draw) -> None:
    keys = stream_keys((3, 4, 5), "noise")
    whole = draw(keys, 10, 6, (4, 2))
    assert whole.shape == (6, 3, 4, 2)
    assert whole.dtype == np.float32
    for k in range(6):
        for s in range(3):
            assert np.array_equal(draw(keys[s:s + 1], 10 + k, 1, (4, 2))[0, 0], whole[k, s])


@pytest.mark.parametrize(("draw", "law"), [(uniform, "uniform"), (normal, "norm")])
def test_draws_have_their_distribution_along_every_axis(draw, law) -> None:
    keys = stream_keys(range(50), "noise")
    numbers = draw(keys, 0, 40, (50,)).astype(np.float64)
    assert kstest(numbers.ravel(), law).pvalue > 1e-3
    columns = [numbers.reshape(40, -1), numbers.swapaxes(0, 1).reshape(50, -1), numbers.swapaxes(0, 2).reshape(50, -1)]
    for rows in columns:
        correlation = np.corrcoef(rows) - np.eye(len(rows))
        assert np.abs(correlation).max() < 0.15


def test_names_and_seeds_give_different_streams() -> None:
    streams = [uniform(stream_keys((seed,), name), 0, 5, (3,)) for seed in (0, 1) for name in ("a", "b")]
    assert len({stream.tobytes() for stream in streams}) == 4


@pytest.mark.parametrize("name", ["replay", "updates", "samples"])
def test_the_keys_of_100_000_seeds_are_distinct(name) -> None:
    """With 31 bits, two of 30,000 seeds had the same "replay" stream."""
    keys = stream_keys(range(100_000), name)
    assert len(np.unique(keys)) == len(keys)
    assert keys.max() > 2**63  # all 64 bits are used


def test_keys_of_64_bits_give_different_streams() -> None:
    keys = stream_keys(range(2_000), "replay")
    assert len(np.unique(uniform(keys, 0, 1, (4,)), axis=1)[0]) == 2_000


def test_uniform_numbers_stay_below_one() -> None:
    numbers = uniform(stream_keys((0,), "a"), 0, 1, (3_000_000,))
    assert numbers.min() >= 0.0
    assert numbers.max() < 1.0
