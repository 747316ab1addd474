"""The losses of TD3, SAC, DDPG-argmax and the regression: row by row in NumPy, their gradients by torch.autograd.

Both look at one update of a stack of two agents that have learnt for a while, so that targets lag behind.
"""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import SAC, TD3, DDPGArgmax, DDPGRegression, StackedAgent

LOW, HIGH = np.array([-1.0, 0.0]), np.array([0.5, 10.0])
HALF, CENTRE = (HIGH - LOW) / 2, (HIGH + LOW) / 2
DISCOUNT, BATCH, SEEDS = 0.9, 32, 2
KINDS = {TD3: {"policy_delay": 1}, SAC: {"temperature": 0.3}, DDPGArgmax: {"candidates": 9}, DDPGRegression: {}}


def trained(kind: type[StackedAgent]) -> StackedAgent:
    settings = kind.settings_type(hidden=(16, 12), batch_size=BATCH, discount=DISCOUNT, polyak=0.9, **KINDS[kind])
    agent = kind(3, LOW, HIGH, settings=settings, seeds=(3, 4), compile=False)
    rng = np.random.default_rng(0)
    agent.add_transitions(rng.normal(size=(SEEDS, 200, 3)), rng.uniform(LOW, HIGH, (SEEDS, 200, 2)),
                   rng.normal(size=(SEEDS, 200)), rng.normal(size=(SEEDS, 200, 3)), rng.random((SEEDS, 200)) < 0.2)
    agent.train(20)
    return agent


def observed(kind: type[StackedAgent]) -> SimpleNamespace:
    """One update: what went in, the weights before and after it, the losses, and the gradients it left."""
    agent = trained(kind)
    rows = agent._replay.sample(1, BATCH)[0]
    (inputs,) = agent._inputs(agent.num_updates + 1, 1)
    seen = SimpleNamespace(agent=agent, rows=rows, noise=inputs[-1] if inputs[-1] is not True else inputs[-2])
    seen.old = {name: net.weights.flat.clone() for name, net in agent._networks.items()}
    seen.target = {name: net.target.flat.clone() for name, net in agent._networks.items()}
    seen.temperature = agent._log_temperature.values.exp() if kind is SAC else None
    seen.losses = agent._update(rows, *inputs)
    seen.new = {name: net.weights.flat.clone() for name, net in agent._networks.items()}
    return seen


def numpy_layers(seen: SimpleNamespace, flat: torch.Tensor, name: str, index: int) -> list[tuple]:
    return [(layer.weight[index].double().numpy(), layer.bias[index, 0].double().numpy())
            for layer in seen.agent._networks[name].network.split(flat)]


def run_numpy(layers: list[tuple], inputs: np.ndarray) -> np.ndarray:
    for weight, bias in layers[:-1]:
        inputs = np.maximum(inputs @ weight + bias, 0.0)
    return inputs @ layers[-1][0] + layers[-1][1]


def split(row: np.ndarray) -> tuple:
    """State, action, reward, whether it goes on, next state."""
    return row[:3], row[3:5], row[5], row[6], row[7:]


def q(critic: list[tuple], state: np.ndarray, unit: np.ndarray) -> float:
    return run_numpy(critic, np.r_[state, CENTRE + HALF * unit])[0]


def draw(actor: list[tuple], state: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, float]:
    """SAC's action in the unit box, and the logarithm of its density."""
    mean, log_deviation = np.split(run_numpy(actor, state), 2)
    inner = mean + np.exp(log_deviation) * noise
    normal = np.exp(-0.5 * noise**2) / (np.exp(log_deviation) * np.sqrt(2 * np.pi))
    return np.tanh(inner), np.log(np.prod(normal / (1 - np.tanh(inner) ** 2)))


def td3_rows(seen: SimpleNamespace, seed: int, rows: np.ndarray, noise: np.ndarray) -> tuple[float, float]:
    actor, target_actor = (numpy_layers(seen, flat["actor"], "actor", seed) for flat in (seen.old, seen.target))
    twins, target_twins = ([numpy_layers(seen, flat["critics"], "critics", index) for index in (seed, seed + SEEDS)]
                           for flat in (seen.old, seen.target))
    first = numpy_layers(seen, seen.new["critics"], "critics", seed)
    errors, values = [], []
    for row, disturbance in zip(rows, noise, strict=True):
        state, action, reward, goes_on, following = split(row)
        unit = np.tanh(run_numpy(target_actor, following)) + np.clip(0.2 * disturbance, -0.5, 0.5)
        unit = np.clip(unit, -1.0, 1.0)
        y = reward + DISCOUNT * goes_on * min(q(twin, following, unit) for twin in target_twins)
        errors.append(sum((run_numpy(twin, np.r_[state, action])[0] - y) ** 2 for twin in twins))
        values.append(q(first, state, np.tanh(run_numpy(actor, state))))
    return float(np.mean(errors)), -float(np.mean(values))


def sac_rows(seen: SimpleNamespace, seed: int, rows: np.ndarray, noise: np.ndarray) -> tuple[float, float]:
    actor = numpy_layers(seen, seen.old["actor"], "actor", seed)
    twins, target_twins, new_twins = ([numpy_layers(seen, flat["critics"], "critics", index)
                                       for index in (seed, seed + SEEDS)] for flat in (seen.old, seen.target, seen.new))
    temperature = float(seen.temperature[seed])
    errors, losses = [], []
    for row, after, here in zip(rows, noise[0], noise[1], strict=True):
        state, action, reward, goes_on, following = split(row)
        unit, log_density = draw(actor, following, after)
        value = min(q(twin, following, unit) for twin in target_twins) - temperature * log_density
        y = reward + DISCOUNT * goes_on * value
        errors.append(sum((run_numpy(twin, np.r_[state, action])[0] - y) ** 2 for twin in twins))
        unit, log_density = draw(actor, state, here)
        losses.append(temperature * log_density - min(q(twin, state, unit) for twin in new_twins))
    return float(np.mean(errors)), float(np.mean(losses))


def single_critic_rows(seen: SimpleNamespace, seed: int, rows: np.ndarray, noise: np.ndarray) -> tuple[float, float]:
    """DDPG-argmax (with candidates `noise` [N, A]) and the regression."""
    actor, target_actor = (numpy_layers(seen, flat["actor"], "actor", seed) for flat in (seen.old, seen.target))
    critic, target_critic, new_critic = (numpy_layers(seen, flat["critic"], "critic", seed)
                                         for flat in (seen.old, seen.target, seen.new))
    errors, losses = [], []
    for row in rows:
        state, action, reward, goes_on, following = split(row)
        y = reward + DISCOUNT * goes_on * q(target_critic, following, np.tanh(run_numpy(target_actor, following)))
        errors.append((run_numpy(critic, np.r_[state, action])[0] - y) ** 2)
        unit = np.tanh(run_numpy(actor, state))
        if isinstance(seen.agent, DDPGArgmax):
            goal = noise[np.argmax([q(new_critic, state, candidate) for candidate in noise])]
            losses.append(np.sum((unit - goal) ** 2))
        else:
            better = y > q(critic, state, unit)
            losses.append(better * np.sum((unit - (action - CENTRE) / HALF) ** 2))
    return float(np.mean(errors)), float(np.mean(losses))


BY_HAND = {TD3: td3_rows, SAC: sac_rows, DDPGArgmax: single_critic_rows, DDPGRegression: single_critic_rows}


@pytest.mark.parametrize("kind", KINDS)
def test_losses_equal_the_equations_row_by_row(kind: type[StackedAgent]) -> None:
    seen = observed(kind)
    for seed in range(SEEDS):
        noise = seen.noise[seed].double().numpy() if seen.noise.ndim > 1 else np.empty(0)
        critic_loss, actor_loss = BY_HAND[kind](seen, seed, seen.rows[seed].double().numpy(), noise)
        assert float(seen.losses["critic_loss"][seed]) == pytest.approx(critic_loss, rel=1e-4)
        assert float(seen.losses["actor_loss"][seed]) == pytest.approx(actor_loss, rel=1e-4, abs=1e-5)


class Plain:
    """The networks in the plainest words of torch, recorded for autograd."""

    def __init__(self, seen: SimpleNamespace):
        self.seen = seen
        self.state, self.pairs, self.reward, self.goes_on, self.following = seen.agent._replay.unpack(seen.rows)
        self.half, self.centre = (torch.tensor(values, dtype=torch.float32) for values in (HALF, CENTRE))

    def run(self, name: str, flat: torch.Tensor, inputs: torch.Tensor) -> torch.Tensor:
        *hidden, last = self.seen.agent._networks[name].network.split(flat)
        for layer in hidden:
            inputs = torch.relu(inputs @ layer.weight + layer.bias)
        return inputs @ last.weight + last.bias

    def q(self, name: str, flat: torch.Tensor, state: torch.Tensor, unit: torch.Tensor) -> torch.Tensor:
        """Values [S, B, 1], or of both twins [2, S, B, 1]."""
        pairs = torch.cat((state, self.centre + self.half * unit), 2)
        if name == "critic":
            return self.run(name, flat, pairs)
        return self.run(name, flat, torch.cat((pairs, pairs))).view(2, SEEDS, BATCH, 1)

    def y(self, next_values: torch.Tensor) -> torch.Tensor:
        return self.reward + DISCOUNT * self.goes_on * next_values

    def draw(self, actor: torch.Tensor, state: torch.Tensor, noise: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        mean, log_deviation = self.run("actor", actor, state).chunk(2, 2)
        density = torch.distributions.Normal(mean, log_deviation.exp())
        inner = mean + log_deviation.exp() * noise
        return inner.tanh(), (density.log_prob(inner) - (1 - inner.tanh() ** 2).log()).sum(2, keepdim=True)

    def twin_loss(self, critics: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
        errors = self.run("critics", critics, self.pairs.repeat(2, 1, 1)) - y.repeat(2, 1, 1)
        return errors.square().mean((1, 2)).sum()

    def td3(self, actor: torch.Tensor, critics: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        noise = (0.2 * self.seen.noise).clamp(-0.5, 0.5)
        unit = (self.run("actor", self.seen.target["actor"], self.following).tanh() + noise).clamp(-1, 1)
        y = self.y(self.q("critics", self.seen.target["critics"], self.following, unit).amin(0))
        unit = self.run("actor", actor, self.state).tanh()
        return -self.q("critics", self.seen.new["critics"], self.state, unit)[0].mean((1, 2)).sum(), \
            self.twin_loss(critics, y)

    def sac(self, actor: torch.Tensor, critics: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        weight = self.seen.temperature[:, None, None]
        unit, log_density = self.draw(self.seen.old["actor"], self.following, self.seen.noise[:, 0])
        y = self.y(self.q("critics", self.seen.target["critics"], self.following, unit).amin(0) - weight * log_density)
        unit, log_density = self.draw(actor, self.state, self.seen.noise[:, 1])
        values = self.q("critics", self.seen.new["critics"], self.state, unit).amin(0)
        return (weight * log_density - values).mean((1, 2)).sum(), self.twin_loss(critics, y)

    def single_critic(self, actor: torch.Tensor, critic: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        unit = self.run("actor", self.seen.target["actor"], self.following).tanh()
        y = self.y(self.q("critic", self.seen.target["critic"], self.following, unit))
        critic_loss = (self.run("critic", critic, self.pairs) - y).square().mean((1, 2)).sum()
        unit = self.run("actor", actor, self.state).tanh()
        if isinstance(self.seen.agent, DDPGArgmax):
            values = [self.q("critic", self.seen.new["critic"], self.state, candidate[:, None].expand_as(unit))
                      for candidate in self.seen.noise.unbind(1)]
            choice = torch.cat(values, 2).argmax(2)
            goals = torch.stack([self.seen.noise[seed][choice[seed]] for seed in range(SEEDS)])
            return (unit - goals).square().sum(2).mean(1).sum(), critic_loss
        better = y > self.q("critic", self.seen.old["critic"], self.state, unit)
        taken = (self.pairs[..., 3:] - self.centre) / self.half
        return (better * (unit - taken).square()).sum(2).mean(1).sum(), critic_loss


BY_AUTOGRAD = {TD3: Plain.td3, SAC: Plain.sac, DDPGArgmax: Plain.single_critic, DDPGRegression: Plain.single_critic}


@pytest.mark.parametrize("kind", KINDS)
def test_gradients_equal_autograd(kind: type[StackedAgent]) -> None:
    seen = observed(kind)
    leaves = [flat.clone().requires_grad_() for flat in seen.old.values()]
    losses = BY_AUTOGRAD[kind](Plain(seen), *leaves)
    for loss, leaf, net in zip(losses, leaves, seen.agent._networks.values(), strict=True):
        (expected,) = torch.autograd.grad(loss, leaf, retain_graph=True)
        torch.testing.assert_close(net.gradient.flat, expected, rtol=1e-3, atol=1e-5)


def test_sac_learns_the_temperature_from_the_entropy() -> None:
    """The gradient of -log(temperature) (log-density + wanted entropy), with a wanted entropy of -2 for two actions."""
    seen = observed(SAC)
    plain = Plain(seen)
    _, log_density = plain.draw(seen.old["actor"], plain.state, seen.noise[:, 1])
    slope = seen.agent._log_temperature.gradient
    torch.testing.assert_close(slope, 2.0 - log_density.mean((1, 2)), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(seen.losses["temperature"], seen.temperature)


def test_a_temperature_without_learning_rate_stays() -> None:
    agent = SAC(3, LOW, HIGH, settings=SAC.settings_type(hidden=(8,), temperature=0.3, temperature_learning_rate=0.0))
    agent.add_transitions(*(np.zeros(shape) for shape in ((1, 9, 3), (1, 9, 2), (1, 9), (1, 9, 3), (1, 9))))
    assert agent.train(5)["temperature"] == pytest.approx(0.3)


def test_sac_draws_from_the_density_that_it_learns_with() -> None:
    """The mean of 1/density over drawn actions is the size of the box, 2 x 2 in half-widths."""
    agent = trained(SAC)
    observations = torch.zeros(SEEDS, 20_000, 3)
    sample = agent._sample(observations, torch.randn(SEEDS, 20_000, 2, generator=torch.Generator().manual_seed(0)))
    np.testing.assert_allclose((-sample.log_density).exp().mean(dim=(1, 2)), 4.0, rtol=0.1)
    drawn = agent.explore(observations.numpy())
    np.testing.assert_allclose(drawn.mean(axis=1), (CENTRE + HALF * sample.unit.numpy()).mean(axis=1), atol=0.15)
    assert not np.array_equal(drawn, agent.explore(observations.numpy()))


def test_sac_cuts_off_the_log_deviation_and_its_slope() -> None:
    agent = trained(SAC)
    agent._actor.weights.layers[-1].bias[..., 2:] = torch.tensor([50.0, -50.0])
    sample = agent._sample(torch.zeros(SEEDS, 1, 3), torch.zeros(SEEDS, 1, 2))
    torch.testing.assert_close(sample.deviation[0, 0], torch.tensor([2.0, -20.0]).exp())
    assert not sample.free.any()


def test_td3_leaves_actor_and_targets_alone_in_every_other_update() -> None:
    agent = trained(TD3).clone()
    agent.settings = TD3.settings_type(hidden=(16, 12), batch_size=BATCH, policy_delay=2)
    before = {name: tensor.clone() for name, tensor in agent._tensors().items()}
    assert agent.train(1)["actor_loss"].tolist() == [0.0, 0.0]  # the 21st
    same = {name for name, tensor in agent._tensors().items() if torch.equal(tensor, before[name])}
    assert same == {"actor/weights", "actor/target", "actor/mean", "actor/square", "critics/target"}
    agent.train(1)
    assert not any(torch.equal(tensor, before[name]) for name, tensor in agent._tensors().items())
