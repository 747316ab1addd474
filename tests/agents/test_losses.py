"""The losses: row by row in NumPy from their equations, and the hand-written gradients against autograd."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import SAC, TD3, DDPGArgmax, StackedAgent, losses
from pbcs_ompl.agents.ddpg_argmax import best_candidates
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.losses import ActionBox
from pbcs_ompl.agents.networks import MLP, TrainedNetwork, TrainedScalar
from pbcs_ompl.agents.replay import Batch

LOW, HIGH = np.array([-1.0, 0.0]), np.array([0.5, 10.0])
HALF, CENTRE = (HIGH - LOW) / 2, (HIGH + LOW) / 2
BOX = ActionBox(torch.tensor(HALF).float(), torch.tensor(CENTRE).float())
DISCOUNT, BATCH, SEEDS = 0.9, 32, 2
LOSSES = pytest.mark.parametrize(("loss", "averaged"), [*((loss, False) for loss in GRADIENTS),
                                                        (losses.soft_policy_loss, True)],
                                 ids=lambda value: getattr(value, "__name__", value))
"""Every loss that has a gradient by hand; that of SAC's actor with the mean of the critics too."""
CPU = torch.device("cpu")


def network(outputs: int, *seeds: int, inputs: int = 3, layer_norm: bool = False) -> TrainedNetwork:
    generators = [np.random.default_rng(seed) for seed in seeds]
    return TrainedNetwork(MLP((inputs, 16, 12, outputs), layer_norm), generators, CPU)


def randn(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def arguments(loss: object, layer_norm: bool, averaged: bool = False) -> tuple:
    """What the loss is given: first what is trained, then the rest."""
    actor, critic = network(2, 1, 2, layer_norm=layer_norm), network(1, 3, 4, inputs=5, layer_norm=layer_norm)
    observations = randn(SEEDS, BATCH, 3)
    squashed, targets = randn(SEEDS, BATCH, 2, seed=1).tanh(), randn(SEEDS, BATCH, 1, seed=2)
    obs_actions = BOX.join(observations, squashed)
    if loss is losses.critic_loss:
        return critic, obs_actions, targets
    if loss is losses.policy_loss:
        return actor, critic.weights, observations, BOX
    if loss is losses.imitation_loss:
        return actor, observations, squashed
    if loss is losses.improvement_loss:
        return actor, critic.weights, obs_actions, targets, BOX
    if loss is losses.soft_policy_loss:
        actor = network(4, 1, 2, layer_norm=layer_norm)
        critics = network(1, *range(3, 9), inputs=5, layer_norm=layer_norm)
        noise, stack = randn(SEEDS, BATCH, 2, seed=3), losses.CriticStack(3, averaged)
        return actor, critics.weights, observations, noise, torch.tensor([0.3, 0.1]), BOX, stack
    assert loss is losses.temperature_loss
    return TrainedScalar(torch.tensor([-1.0, 0.5]), CPU), randn(SEEDS, BATCH, 1), -2.0


def flat_gradient(trained: TrainedNetwork | TrainedScalar) -> torch.Tensor:
    return (trained.gradient if isinstance(trained, TrainedScalar) else trained.gradient.flat).clone()


@pytest.mark.parametrize("layer_norm", [False, True])
@LOSSES
def test_hand_written_gradients_equal_autograd(loss, averaged: bool, layer_norm: bool) -> None:
    trained, *rest = arguments(loss, layer_norm, averaged)
    expected, gradient = trained.autograd(loss, *rest), flat_gradient(trained)
    outcome, by_hand = GRADIENTS[loss](trained, *rest), flat_gradient(trained)
    torch.testing.assert_close(outcome, expected, rtol=1e-6, atol=1e-6)
    torch.testing.assert_close(by_hand, gradient, rtol=1e-5, atol=1e-6)
    assert gradient.abs().max() > 0.0


@LOSSES
def test_autograd_equals_difference_quotients(loss, averaged: bool) -> None:
    """In float32 only two digits of a quotient are sure: it is taken along the gradient itself, where it is largest."""
    trained, *rest = arguments(loss, False, averaged)
    trained.autograd(loss, *rest)
    gradient = flat_gradient(trained)
    values = trained.values if isinstance(trained, TrainedScalar) else trained.weights.flat
    step = 1e-3 * gradient / gradient.norm()
    total = []
    for sign in (1.0, -1.0):
        values.add_(sign * step)
        outcome = loss(trained.values if isinstance(trained, TrainedScalar) else trained.weights, *rest)
        total.append(float((outcome[0] if isinstance(outcome, tuple) else outcome).double().sum()))
        values.sub_(sign * step)
    assert (total[0] - total[1]) / 2e-3 == pytest.approx(float(gradient.norm()), rel=0.05)


def numpy_network(trained: TrainedNetwork, index: int, target: bool = False):
    """One network of a stack as a function of a vector, in float64."""
    layers = [(layer.weight[index].double().numpy(), layer.bias[index, 0].double().numpy())
              for layer in (trained.target if target else trained.weights).layers]

    def run(inputs: np.ndarray) -> np.ndarray:
        for weight, bias in layers[:-1]:
            inputs = np.maximum(inputs @ weight + bias, 0.0)
        return inputs @ layers[-1][0] + layers[-1][1]

    return run


def q(critic, state: np.ndarray, squashed: np.ndarray) -> float:
    return float(critic(np.r_[state, CENTRE + HALF * squashed])[0])


def draw(actor, state: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, float]:
    """SAC's squashed action and the logarithm of its density."""
    mean, log_std = np.split(actor(state), 2)
    inner = mean + np.exp(log_std) * noise
    normal = np.exp(-0.5 * noise**2) / (np.exp(log_std) * np.sqrt(2 * np.pi))
    return np.tanh(inner), np.log(np.prod(normal / (1 - np.tanh(inner) ** 2)))


def row_losses(loss: object, trained, rest: list, seed: int) -> list[float]:
    """The loss of each item of one seed's mini-batch."""
    double = [part[seed].double().numpy() if isinstance(part, torch.Tensor) and part.ndim == 3 else part
              for part in rest]
    if loss is losses.temperature_loss:
        return [-float(trained.values[seed]) * (float(density[0]) + rest[1]) for density in double[0]]
    own = numpy_network(trained, seed)
    if loss is losses.critic_loss:
        return [float((own(pair)[0] - y[0]) ** 2) for pair, y in zip(*double, strict=True)]
    if loss is losses.imitation_loss:
        return [float(np.sum((np.tanh(own(state)) - c) ** 2)) for state, c in zip(*double, strict=True)]
    weights, count = rest[0], rest[0].layers[0].weight.shape[0] // SEEDS
    critics = []
    for index in range(seed, count * SEEDS, SEEDS):
        stand_in = TrainedNetwork(weights.network, [np.random.default_rng()] * count * SEEDS, CPU)
        stand_in.weights.flat.copy_(weights.flat)
        critics.append(numpy_network(stand_in, index))
    if loss is losses.policy_loss:
        return [-q(critics[0], state, np.tanh(own(state))) for state in double[1]]
    if loss is losses.improvement_loss:
        better = [float(y[0]) > q(critics[0], pair[:3], np.tanh(own(pair[:3])))
                  for pair, y in zip(double[1], double[2], strict=True)]
        assert 0 < sum(better) < BATCH
        return [float(one * np.sum((np.tanh(own(pair[:3])) - (pair[3:] - CENTRE) / HALF) ** 2))
                for one, pair in zip(better, double[1], strict=True)]
    drawn = [draw(own, state, noise) for state, noise in zip(double[1], double[2], strict=True)]
    value = np.mean if rest[-1].averaged else min
    return [float(rest[3][seed]) * density - value([q(critic, state, squashed) for critic in critics])
            for state, (squashed, density) in zip(double[1], drawn, strict=True)]


@LOSSES
def test_losses_equal_their_equations_row_by_row(loss, averaged: bool) -> None:
    trained, *rest = arguments(loss, False, averaged)
    outcome = loss(trained.values if isinstance(trained, TrainedScalar) else trained.weights, *rest)
    values = outcome[0] if isinstance(outcome, tuple) else outcome
    for seed in range(SEEDS):
        assert float(values[seed]) == pytest.approx(np.mean(row_losses(loss, trained, rest, seed)), rel=1e-4, abs=1e-5)


CHOSEN = torch.tensor([[True, False, True], [False, True, True]])
"""Which of three critics of each seed give its targets."""


def trained_agent(kind: type[StackedAgent], **settings: object) -> StackedAgent:
    """A stack that has learnt for a while, so that targets differ from the networks."""
    chosen = kind.settings_type(hidden=(16, 12), batch_size=BATCH, discount=DISCOUNT, polyak=0.9, **settings)
    agent = kind(3, LOW, HIGH, settings=chosen, seeds=(3, 4), compile=False)
    rng = np.random.default_rng(0)
    agent.add_transitions(rng.normal(size=(SEEDS, 200, 3)), rng.uniform(LOW, HIGH, (SEEDS, 200, 2)),
                          rng.normal(size=(SEEDS, 200)), rng.normal(size=(SEEDS, 200, 3)),
                          rng.random((SEEDS, 200)) < 0.2)
    agent.train(20)
    return agent


def batch_of(agent: StackedAgent) -> Batch:
    return agent.replay.unpack(agent.replay.sample(1, BATCH)[0])


def next_values(batch: Batch, targets: torch.Tensor, seed: int) -> list[tuple[np.ndarray, float, float]]:
    """The next state of each item that is not terminal, the value Q' that its target was made from, and its index."""
    rows = []
    for index in range(BATCH):
        y, reward = float(targets[seed, index]), float(batch.rewards[seed, index])
        if float(batch.not_done[seed, index]) == 0.0:
            assert y == reward
        else:
            rows.append((batch.next_observations[seed, index].double().numpy(), (y - reward) / DISCOUNT, index))
    assert 0 < len(rows) < BATCH
    return rows


@pytest.mark.parametrize("kind", [DDPGArgmax])
def test_targets_of_ddpg_equal_eq_1_2(kind: type[StackedAgent]) -> None:
    agent = trained_agent(kind)
    batch = batch_of(agent)
    for seed in range(SEEDS):
        actor, critic = numpy_network(agent.actor, seed, True), numpy_network(agent.critic, seed, True)
        for state, value, _ in next_values(batch, agent.td_targets(batch), seed):
            assert value == pytest.approx(q(critic, state, np.tanh(actor(state))), rel=1e-3, abs=1e-4)


def test_targets_of_td3_are_the_least_value_of_the_chosen_critics_at_a_smoothed_action() -> None:
    agent, noise = trained_agent(TD3, critics=3), randn(SEEDS, BATCH, 2)
    batch = batch_of(agent)
    for seed in range(SEEDS):
        actor = numpy_network(agent.actor, seed, True)
        two = [numpy_network(agent.critic, index, True) for index in CHOSEN[seed].nonzero()[:, 0] * SEEDS + seed]
        for state, value, index in next_values(batch, agent.smoothed_targets(batch, noise, CHOSEN), seed):
            disturbed = np.tanh(actor(state)) + noise[seed, index].double().numpy()
            expected = min(q(critic, state, np.clip(disturbed, -1.0, 1.0)) for critic in two)
            assert value == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_noise_on_the_actions_of_td3_is_clipped() -> None:
    agent = trained_agent(TD3, target_noise=0.4)
    noise = torch.as_tensor(agent.update_inputs(1, 200)[2])
    assert noise.shape == (200, SEEDS, BATCH, 2)
    normal = torch.erfinv(torch.linspace(-1.0, 1.0, 20_001)[1:-1]) * 2**0.5
    assert noise.abs().max() == 0.5
    assert float(noise.std()) == pytest.approx(float((0.4 * normal).clamp(-0.5, 0.5).std()), rel=0.02)


def test_targets_of_sac_are_the_least_value_of_the_chosen_critics_and_the_entropy() -> None:
    agent, noise, temperature = trained_agent(SAC, critics=3), randn(SEEDS, BATCH, 2), torch.tensor([0.3, 0.7])
    batch = batch_of(agent)
    for seed in range(SEEDS):
        actor = numpy_network(agent.actor, seed)
        two = [numpy_network(agent.critic, index, True) for index in CHOSEN[seed].nonzero()[:, 0] * SEEDS + seed]
        for state, value, index in next_values(batch, agent.soft_targets(batch, noise, CHOSEN, temperature), seed):
            squashed, density = draw(actor, state, noise[seed, index].double().numpy())
            expected = min(q(critic, state, squashed) for critic in two) - float(temperature[seed]) * density
            assert value == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_the_best_candidate_has_the_largest_value() -> None:
    critic, observations, candidates = network(1, 3, 4, inputs=5), randn(SEEDS, 8, 3), randn(SEEDS, 9, 2).tanh()
    best = best_candidates(critic.weights, observations, candidates, BOX)
    for seed in range(SEEDS):
        one = numpy_network(critic, seed)
        for state, chosen in zip(observations[seed].double().numpy(), best[seed], strict=True):
            values = [q(one, state, candidate) for candidate in candidates[seed].double().numpy()]
            assert torch.equal(chosen, candidates[seed, int(np.argmax(values))])


def test_sac_learns_the_temperature_from_the_entropy() -> None:
    """Adam's first steps have the length of the learning rate, up where the policy has less entropy than wanted."""
    agent = trained_agent(SAC, temperature=0.3)
    temperature = agent.train(1)["temperature"]
    assert ((np.abs(np.log(temperature / 0.3)) > 0.0) & (np.abs(np.log(temperature / 0.3)) < 0.1)).all()
    fixed = trained_agent(SAC, temperature=0.3, temperature_learning_rate=0.0)
    assert fixed.train(5)["temperature"] == pytest.approx(0.3)


def test_sac_draws_from_the_density_that_it_learns_with() -> None:
    """The mean of 1/density over drawn actions is the size of the box, 2 x 2 in half-widths."""
    agent = trained_agent(SAC)
    observations = torch.zeros(SEEDS, 20_000, 3)
    squashed, log_density = losses.sample_squashed(agent.actor.weights(observations), randn(SEEDS, 20_000, 2))
    np.testing.assert_allclose((-log_density).exp().mean(dim=(1, 2)), 4.0, rtol=0.1)
    drawn = agent.explore(observations.numpy())
    np.testing.assert_allclose(drawn.mean(axis=1), (CENTRE + HALF * squashed.numpy()).mean(axis=1), atol=0.15)
    assert not np.array_equal(drawn, agent.explore(observations.numpy()))


def test_the_log_standard_deviation_is_bounded_and_has_no_gradient_beyond() -> None:
    outputs = torch.tensor([[[0.0, 0.0, 50.0, -50.0]]], requires_grad=True)
    noise = torch.tensor([[[1e-3, 1e6]]])
    squashed, log_density = losses.sample_squashed(outputs, noise)
    torch.testing.assert_close(squashed[0, 0], (noise[0, 0] * torch.tensor([2.0, -20.0]).exp()).tanh())
    (gradient,) = torch.autograd.grad(log_density.sum(), outputs)
    assert gradient[0, 0, 2:].tolist() == [0.0, 0.0]


def test_td3_changes_actor_and_targets_in_every_other_update_only() -> None:
    agent = trained_agent(TD3)
    before = agent.state_dict()
    assert agent.train(1)["actor_loss"].tolist() == [0.0, 0.0]  # the 21st
    after = agent.state_dict()
    networks = {name for name in before if name.startswith(("actor/", "critic/"))}
    same = {name for name in networks if np.array_equal(after[name], before[name])}
    assert same == {"actor/weights", "actor/target", "actor/mean", "actor/square", "critic/target"}
    agent.train(1)
    assert not any(np.array_equal(agent.state_dict()[name], before[name]) for name in networks)
