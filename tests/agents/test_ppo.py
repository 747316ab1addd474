"""PPO: its advantages and losses from their equations, stacks, resuming, and that it learns."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import PPO, NonFiniteData, PPOSettings, Rollout, advantages, losses
from pbcs_ompl.agents.networks import TrainedScalar
from pbcs_ompl.core.errors import InvalidOption, Mismatch, UnsupportedSpace

LOW, HIGH = [-1.0, 0.0], [0.5, 10.0]
SMALL = PPOSettings(hidden=(24, 20), batch_size=64, epochs=3)


def make(*seeds: int, settings: PPOSettings = SMALL) -> PPO:
    return PPO(3, LOW, HIGH, settings=settings, seeds=seeds)


def rollout(agent: PPO, *seeds: int, length: int = 8, states: int = 16) -> Rollout:
    """What the agent does in random observations, with random rewards; one seed of these for each agent."""
    rngs = [np.random.default_rng(seed) for seed in seeds]
    steps = []
    for _ in range(length):
        observations = np.stack([rng.normal(size=(states, 3)) for rng in rngs])
        drawn = agent.explore(observations)
        rewards, continues = (np.stack([rng.random(states) for rng in rngs]) for _ in range(2))
        ends = np.stack([rng.random(states) < 0.2 for rng in rngs])
        steps.append((observations, drawn.inner, drawn.log_densities, rewards, drawn.values, drawn.values[:, ::-1],
                      continues, ends))
    return Rollout(*(np.stack(part, axis=1) for part in zip(*steps, strict=True)))


def probe(agent: PPO) -> np.ndarray:
    observations = np.stack([np.random.default_rng(99).normal(size=(50, 3))] * len(agent.seeds))
    return np.concatenate([agent.act(observations), agent.value(observations)[..., None]], axis=2)


def test_advantages_are_sums_of_discounted_errors() -> None:
    """A_t = sum_k (product over j < k of gamma c_t+j lambda) delta_t+k, as far as the episode goes."""
    rng = np.random.default_rng(0)
    shape = (2, 6, 3)
    rewards, values, following, continues = (rng.normal(size=shape) for _ in range(4))
    continues, ends = np.abs(np.tanh(continues)), rng.random(shape) < 0.3
    found = advantages(Rollout(np.zeros((*shape, 1)), np.zeros((*shape, 1)), rewards, rewards, values, following,
                               continues, ends), 0.9, 0.8)
    for s, t, n in np.ndindex(shape):
        expected, weight = 0.0, 1.0
        for k in range(t, shape[1]):
            place = s, k, n
            expected += weight * (rewards[place] + 0.9 * continues[place] * following[place] - values[place])
            weight *= 0.9 * continues[place] * 0.8
            if ends[place]:
                break
        assert found[s, t, n] == pytest.approx(expected)


def test_the_loss_is_the_clipped_surrogate_row_by_row() -> None:
    rng = np.random.default_rng(1)
    inner, means = rng.normal(size=(2, 40, 2)), np.tanh(rng.normal(size=(2, 40, 2)))
    gains, log_std = rng.normal(size=(2, 40)), np.array([[-1.0, 0.2], [0.0, -0.5]])
    std = np.exp(log_std)[:, None]
    density = np.log(np.prod(np.exp(-0.5 * ((inner - means) / std) ** 2) / (std * np.sqrt(2 * np.pi)), axis=2))
    before = density + 0.4 * rng.normal(size=density.shape)
    ratio = np.exp(density - before)
    clipped = np.where(gains > 0, np.minimum(ratio, 1.2), np.maximum(ratio, 0.8)) * gains
    tensors = [torch.tensor(part).float() for part in (inner, before, gains, log_std)]
    outcome, divergence, found = losses.clipped_policy_loss(
        lambda inputs: torch.atanh(inputs), torch.tensor(means).float(), *tensors, 0.2)
    np.testing.assert_allclose(outcome.numpy(), -clipped.mean(axis=1), rtol=1e-4)
    np.testing.assert_allclose(divergence.numpy(), (ratio - 1 - np.log(ratio)).mean(axis=1), rtol=1e-3)
    np.testing.assert_allclose(found.numpy(), means, atol=1e-5)
    inner_t, before_t, gains_t, log_std_t = tensors
    spread = losses.clipped_spread_loss(log_std_t, found, inner_t, before_t, gains_t, 0.2, 0.01)
    np.testing.assert_allclose(spread.numpy(), -clipped.mean(axis=1) - 0.01 * log_std.sum(axis=1), rtol=1e-4)


def test_the_gradient_of_the_spread_is_the_difference_quotient() -> None:
    generator = torch.Generator().manual_seed(0)
    means, inner = (torch.randn(1, 500, 2, generator=generator) for _ in range(2))
    gains, log_std = torch.randn(1, 500, generator=generator), torch.tensor([[-0.3, 0.1]])
    before = losses.normal_log_density(inner, means, log_std)
    trained = TrainedScalar(log_std, torch.device("cpu"))
    trained.autograd(losses.clipped_spread_loss, means, inner, before, gains, 0.2, 0.01)
    for k in range(2):
        moved = [log_std + sign * 1e-3 * torch.eye(2)[k] for sign in (1.0, -1.0)]
        up, down = (losses.clipped_spread_loss(one, means, inner, before, gains, 0.2, 0.01) for one in moved)
        assert float(trained.gradient[0, k]) == pytest.approx(float(up - down) / 2e-3, rel=0.05, abs=1e-3)


def test_a_stack_equals_separate_agents() -> None:
    stack = make(5, 6, 7)
    for _ in range(2):
        found = stack.train(rollout(stack, 0, 1, 2))
    for index, seed in enumerate((5, 6, 7)):
        alone = make(seed)
        for _ in range(2):
            own = alone.train(rollout(alone, index))
        np.testing.assert_allclose(probe(stack)[index], probe(alone)[0], atol=1e-4)
        for name in found:
            np.testing.assert_allclose(found[name][index], own[name][0], rtol=1e-3, atol=1e-6)


def test_changing_one_seed_leaves_the_others_bit_equal() -> None:
    first, second = make(5, 6), make(5, 8)
    first.train(rollout(first, 0, 1))
    second.train(rollout(second, 0, 9))
    assert np.array_equal(probe(first)[0], probe(second)[0])
    assert not np.array_equal(probe(first)[1], probe(second)[1])


def test_saved_and_loaded_agents_continue_bit_for_bit() -> None:
    first = make(1, 2)
    first.train(rollout(first, 3, 4))
    second = make(1, 2)
    second.load_state_dict({name: array.copy() for name, array in first.state_dict().items()})
    for agent in (first, second):
        agent.train(rollout(agent, 5, 6))
    mine, theirs = first.state_dict(), second.state_dict()
    assert mine.keys() == theirs.keys()
    for name in mine:
        assert np.array_equal(mine[name], theirs[name]), name
    assert first.num_iterations == 2
    assert first.num_updates == 2 * 3 * 2


def test_the_learning_rate_follows_the_divergence() -> None:
    for target, grows in ((1e-7, False), (10.0, True)):
        agent = make(1, settings=PPOSettings(hidden=(24, 20), batch_size=64, kl_target=target))
        agent.train(rollout(agent, 0))
        assert (agent.learning_rates[0] > 3e-4) == grows
        for _ in range(15):
            agent.train(rollout(agent, 0))
        assert agent.learning_rates[0] == (2e-3 if grows else 5e-5)


def test_actions_are_in_the_box_and_the_policy_is_a_snapshot() -> None:
    agent = make(1, 2)
    observations = np.random.default_rng(0).normal(size=(2, 300, 3))
    drawn = agent.explore(observations)
    for actions in (agent.act(observations), drawn.actions):
        assert actions.shape == (2, 300, 2)
        assert ((actions >= LOW) & (actions <= HIGH)).all()
    np.testing.assert_allclose(drawn.values, agent.value(observations), atol=1e-6)
    policy = agent.policy(1)
    np.testing.assert_allclose(policy.act(observations[1]), agent.act(observations)[1], atol=1e-5)
    before = policy.act(observations[1])
    agent.train(rollout(agent, 0, 1))
    assert np.array_equal(policy.act(observations[1]), before)


def test_it_drives_a_point_to_the_middle_and_values_it() -> None:
    """x' = x + 0.2 a, reward -x'^2, in 30 iterations of 1,024 transitions."""
    settings = PPOSettings(hidden=(32, 32), batch_size=256, discount=0.9)
    agent = PPO(1, [-1.0], [1.0], settings=settings, seeds=(0, 1))
    rng = np.random.default_rng(0)
    places = rng.uniform(-1, 1, (2, 64))
    for _ in range(30):
        steps = []
        for _ in range(16):
            drawn = agent.explore(places[..., None])
            after = np.clip(places + 0.2 * drawn.actions[..., 0], -1, 1)
            ends = rng.random(after.shape) < 0.1
            steps.append((places[..., None], drawn.inner, drawn.log_densities, -after**2, drawn.values,
                          agent.value(after[..., None]), np.ones(after.shape), ends))
            places = np.where(ends, rng.uniform(-1, 1, after.shape), after)
        agent.train(Rollout(*(np.stack(part, axis=1) for part in zip(*steps, strict=True))))
    probed = np.array([-0.8, -0.4, 0.4, 0.8])[None, :, None].repeat(2, axis=0)
    assert (agent.act(probed)[..., 0] * probed[..., 0] < -0.2).all()
    values = agent.value(np.array([[[0.0], [0.9]]] * 2))
    assert (values[:, 0] > values[:, 1] + 0.5).all()


@pytest.mark.parametrize("wrong", [
    {"discount": 1.5}, {"hidden": ()}, {"batch_size": 0}, {"clip": 0.0}, {"kl_target": -1.0}, {"epochs": 2.5},
    {"initial_std": 0.0}, {"trace_decay": float("nan")}, {"entropy_weight": -1.0}, {"learning_rate": 0.0}])
def test_settings_out_of_range_are_named(wrong: dict) -> None:
    with pytest.raises(InvalidOption, match=next(iter(wrong))):
        PPOSettings(**wrong)


def test_settings_survive_a_file() -> None:
    assert PPOSettings.from_dict(SMALL.to_dict()) == SMALL
    with pytest.raises(InvalidOption, match="'epochs'"):
        PPOSettings.from_dict({"epoch": 3})


def test_wrong_rollouts_and_states_are_refused() -> None:
    agent = make(1)
    with pytest.raises(InvalidOption, match="a rollout of 2 seeds"):
        agent.train(rollout(make(1, 2), 0, 1))
    with pytest.raises(InvalidOption, match="32 transitions, expected at least batch_size=64"):
        agent.train(rollout(agent, 0, length=2))
    broken = rollout(agent, 0)
    broken.rewards[0, 1, 2] = np.nan
    with pytest.raises(NonFiniteData, match="rewards of a rollout hold NaN or infinity, in iteration 1"):
        agent.train(broken)
    state = agent.state_dict()
    with pytest.raises(Mismatch, match="seeds"):
        make(2).load_state_dict(state)
    with pytest.raises(Mismatch, match="other settings"):
        make(1, settings=PPOSettings(hidden=(8,))).load_state_dict(state)
    with pytest.raises(Mismatch, match="missing"):
        agent.load_state_dict({name: state[name] for name in state if name != "counts"})
    with pytest.raises(UnsupportedSpace):
        PPO(2, [-1.0], [np.inf])
    with pytest.raises(InvalidOption, match="0 seeds"):
        PPO(2, [-1.0], [1.0], seeds=())
