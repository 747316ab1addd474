"""Laws of the three noises: what they draw, their bounds, where they start again, and that seeds are independent."""

import numpy as np
import pytest

from pbcs_ompl.agents import EpsilonGreedy, Gaussian, OrnsteinUhlenbeck, make_noise
from pbcs_ompl.agents.noise import NOISES, draw_all
from pbcs_ompl.core.errors import InvalidOption, UnknownName

LOW, HIGH = np.array([-1.0, 2.0]), np.array([0.0, 5.0])
HALF = (HIGH - LOW) / 2
CENTRE = (HIGH + LOW) / 2


def generators(*seeds: int) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in seeds]


def one_step(noise, actions: np.ndarray, seed: int = 0) -> np.ndarray:
    draws = draw_all(noise, generators(*range(seed, seed + len(actions))), actions.shape[1:2], 2)
    return noise.apply(actions, draws, np.ones(actions.shape[:2], dtype=bool), LOW, HIGH)


@pytest.mark.parametrize("epsilon", [0.0, 0.3, 1.0])
def test_epsilon_greedy_replaces_that_share_by_uniform_actions(epsilon: float) -> None:
    actions = np.broadcast_to([-0.25, 3.0], (3, 4000, 2))
    noisy = one_step(EpsilonGreedy(epsilon), actions)
    changed = (noisy != actions).any(axis=-1)
    assert changed.mean() == pytest.approx(epsilon, abs=0.02)
    if epsilon:
        np.testing.assert_allclose(noisy[changed].mean(axis=0), CENTRE, atol=0.06)
        np.testing.assert_allclose(noisy[changed].std(axis=0), (HIGH - LOW) / 12**0.5, atol=0.06)


def test_gaussian_noise_has_its_deviation_in_units_of_half_the_box() -> None:
    noisy = one_step(Gaussian(0.1), np.broadcast_to(CENTRE, (3, 8000, 2)))
    np.testing.assert_allclose(noisy.mean(axis=(0, 1)), CENTRE, atol=0.01)
    np.testing.assert_allclose(noisy.std(axis=(0, 1)) / HALF, 0.1, rtol=0.03)


def test_ornstein_uhlenbeck_noise_follows_its_equation_and_begins_each_episode_at_0() -> None:
    noise = OrnsteinUhlenbeck(sigma=0.2, theta=0.15, dt=0.01)
    draws = draw_all(noise, generators(1, 2), (6, 3), 2)
    fresh = np.zeros((6, 2, 3), dtype=bool)
    fresh[0] = fresh[4, 1, 2] = True
    expected = np.zeros((2, 3, 2))
    for t in range(6):
        expected = np.where(fresh[t][..., None], 0.0, expected)
        expected = expected - 0.15 * 0.01 * expected + 0.2 * 0.1 * draws[:, t]
        tried = noise.apply(np.broadcast_to(CENTRE, (2, 3, 2)), draws[:, t], fresh[t], LOW, HIGH)
        np.testing.assert_allclose((tried - CENTRE) / HALF, expected, atol=1e-12)


def test_ornstein_uhlenbeck_noise_grows_with_the_age_of_the_episode_towards_its_long_run_deviation() -> None:
    noise, steps = OrnsteinUhlenbeck(sigma=0.1, theta=0.5, dt=0.1), 200
    draws = draw_all(noise, generators(*range(4)), (steps, 500), 2)
    spread = []
    for t in range(steps):
        fresh = np.full((4, 500), t == 0)
        tried = noise.apply(np.broadcast_to(CENTRE, (4, 500, 2)), draws[:, t], fresh, LOW, HIGH)
        spread.append(((tried - CENTRE) / HALF).std())
    assert spread[0] == pytest.approx(0.1 * 0.1**0.5, rel=0.1)
    assert spread[-1] == pytest.approx(0.1 * (0.1 / (1 - (1 - 0.05) ** 2)) ** 0.5, rel=0.1)


@pytest.mark.parametrize("name", NOISES)
def test_every_noise_stays_in_the_box_and_leaves_the_given_actions_alone(name: str) -> None:
    actions = np.random.default_rng(0).uniform(LOW, HIGH, (2, 500, 2))
    before = actions.copy()
    tried = one_step(make_noise(name), actions)
    assert tried.shape == actions.shape
    assert ((tried >= LOW) & (tried <= HIGH)).all()
    assert np.array_equal(actions, before)
    assert not np.array_equal(tried, actions)


@pytest.mark.parametrize("name", NOISES)
def test_a_stack_explores_as_separate_seeds_do(name: str) -> None:
    noise = make_noise(name)
    draws = draw_all(noise, generators(5, 6), (4, 3), 2)
    for index, seed in enumerate((5, 6)):
        assert np.array_equal(draws[index], draw_all(noise, generators(seed), (4, 3), 2)[0])


def test_wrong_names_and_values_are_named() -> None:
    with pytest.raises(UnknownName, match="'gaussian'"):
        make_noise("gausian")
    with pytest.raises(InvalidOption, match="'sigma'"):
        make_noise("gaussian", sigmas=0.1)
    with pytest.raises(InvalidOption, match="probability"):
        make_noise("epsilon-greedy", epsilon=1.1)
    with pytest.raises(InvalidOption, match="at least 0"):
        make_noise("gaussian", sigma=float("nan"))
    with pytest.raises(InvalidOption, match="theta"):
        make_noise("ornstein-uhlenbeck", theta=-1.0)


@pytest.mark.parametrize("name", NOISES)
def test_seeds_that_are_kept_explore_as_they_would_have_in_the_whole_stack(name: str) -> None:
    steps, kept = 8, [2, 0]
    whole, part = make_noise(name), make_noise(name)
    part.keep(range(3))  # before the first step there is nothing to lose
    draws = draw_all(whole, generators(1, 2, 3), (steps, 4), 2)
    middle = np.broadcast_to(CENTRE, (3, 4, 2))
    for t in range(steps):
        fresh = np.full((3, 4), t in (0, 6))
        expected = whole.apply(middle, draws[:, t], fresh, LOW, HIGH)
        if t < 4:
            part.apply(middle, draws[:, t], fresh, LOW, HIGH)
        else:
            if t == 4:
                part.keep(kept)
            np.testing.assert_array_equal(part.apply(middle[kept], draws[kept, t], fresh[kept], LOW, HIGH),
                                          expected[kept])
