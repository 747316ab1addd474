"""The exact walk: probability is kept, the first steps are those done by hand, the rest is what a simulation finds."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.studies.toy_analysis.random_walk import densities, found_by, simulate


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 8), st.fractions(0, 1, max_denominator=20))
def test_probability_is_kept_exactly(steps, share):
    found = Fraction(0)
    for density in densities(steps, share):
        found += density.found
        assert found + density.left == 1


def test_the_first_two_steps_are_those_done_by_hand():
    """X_1 is uniform on [-1, 1); of what is left, x_2(z) = 1/4 min(1, z + 1, 2 - z): a quarter of it falls below 0."""
    first, second = densities(2)
    assert first.found == Fraction(1, 2)
    assert second.found == Fraction(1, 8)
    np.testing.assert_allclose(second(np.array([-0.5, 0.0, 0.5, 1.5, 2.5])), np.array([0.25, 0.5, 0.5, 0.25, 0.0]))


def test_a_walk_without_the_sink_is_the_known_limit():
    """Sparre Andersen: a symmetric continuous walk has not been below 0 in n steps with probability C(2n, n) / 4^n."""
    alive = [Fraction(1)]
    for n in range(1, 16):
        alive.append(alive[-1] * Fraction(2 * n - 1, 2 * n))
    assert [density.left for density in densities(15)] == alive[1:]


def test_a_walk_that_never_moves_again_stays():
    densities_of_pauses = list(densities(3, 0))
    assert [density.found for density in densities_of_pauses] == [Fraction(1, 2), 0, 0]


@pytest.mark.parametrize("share", [Fraction(1), Fraction(1, 10)])
def test_simulation_agrees(share):
    steps, walks = 21, 200_000
    exact = found_by(steps, share)
    shares, positions = simulate(walks, steps, float(share), seed=1)
    np.testing.assert_allclose(shares, exact, atol=5 * 0.5 / np.sqrt(walks))
    *_, last = densities(steps, share)
    counts, edges = np.histogram(positions, bins=np.arange(-1.0, 6.5, 0.5))
    fine = np.linspace(0.0, 0.5, 101)[:-1] + 0.0025
    masses = np.array([last(edge + fine).mean() * 0.5 for edge in edges[:-1]])
    np.testing.assert_allclose(counts / len(positions), masses, atol=5 * 0.5 / np.sqrt(len(positions)))


def test_bad_input():
    with pytest.raises(InvalidOption):
        list(densities(0))
    with pytest.raises(InvalidOption):
        list(densities(1, 2))
