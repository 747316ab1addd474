"""Whole updates as kernels: equal to torch where it matters, on any number of threads, and only for what they do."""

import numpy as np
import pytest
import torch
from torch import Tensor

from pbcs_ompl.agents import DDPG, SAC, TD3, StackedAgent, TD3Settings
from pbcs_ompl.agents.several_critics import chosen_critics

KINDS = [DDPG, TD3, SAC]


def pair(kind: type[StackedAgent], seeds: int = 2, **settings: object) -> tuple[StackedAgent, StackedAgent]:
    """The same agent twice: with its kernel, and with hand-written gradients in torch."""
    agents = [kind(5, [-1.0, 0.0], [0.5, 10.0], settings=kind.settings_type(**settings), seeds=range(seeds),
                   compile=compile) for compile in ("auto", False)]
    rng = np.random.default_rng(0)
    size = (seeds, 300)
    data = (rng.normal(size=(*size, 5)), rng.uniform([-1.0, 0.0], [0.5, 10.0], (*size, 2)), rng.normal(size=size),
            rng.normal(size=(*size, 5)), rng.random(size) < 0.2)
    for agent in agents:
        agent.add_transitions(*data)
    return agents[0], agents[1]


def assert_equal(mine: StackedAgent, theirs: StackedAgent, atol: float) -> None:
    expected = theirs.state_dict()
    for name, values in mine.state_dict().items():
        np.testing.assert_allclose(values, expected[name], atol=atol, err_msg=name)


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_wide_networks_are_updated_as_by_torch(kind: type[StackedAgent], layer_norm: bool) -> None:
    kernel, eager = pair(kind, hidden=(128, 256), batch_size=100, layer_norm=layer_norm)
    mine, theirs = kernel.train(20), eager.train(20)
    assert_equal(kernel, eager, 2e-4)  # a fifth of a step of Adam, which decides where a gradient is next to 0
    for name in mine:
        np.testing.assert_allclose(mine[name], theirs[name], rtol=1e-4, atol=1e-6)


def test_the_log_standard_deviation_of_sac_is_bounded_in_the_kernel() -> None:
    kernel, eager = pair(SAC, hidden=(16, 12))
    for agent in (kernel, eager):
        agent.actor.weights.layers[-1].bias[..., 2] = 25.0
        agent.actor.weights.layers[-1].bias[..., 3] = -25.0
    frozen = kernel.actor.weights.layers[-1].bias[..., 2:].clone()
    kernel.train(5)
    eager.train(5)
    assert_equal(kernel, eager, 1e-5)
    assert torch.equal(kernel.actor.weights.layers[-1].bias[..., 2:], frozen)


@pytest.mark.parametrize(("critics", "target_critics"), [(3, 3), (5, 2), (1, 1)])
@pytest.mark.parametrize("kind", [TD3, SAC])
def test_any_number_of_critics_is_updated_as_by_torch(kind: type[StackedAgent], critics: int,
                                                      target_critics: int) -> None:
    kernel, eager = pair(kind, hidden=(16, 12), critics=critics, target_critics=target_critics)
    mine, theirs = kernel.train(20), eager.train(20)
    assert_equal(kernel, eager, 1e-5)
    for name in mine:
        np.testing.assert_allclose(mine[name], theirs[name], rtol=1e-4, atol=1e-6)
    assert kernel.critic_values(np.zeros((2, 1, 5)), np.zeros((2, 1, 2))).shape == (2 * critics, 1)


def test_each_update_draws_as_many_critics_as_give_its_target() -> None:
    settings = TD3Settings(critics=4, target_critics=2)
    chosen = chosen_critics(settings, [3, 4, 5], 1, 1200)
    assert (chosen.sum(axis=2) == 2).all()
    np.testing.assert_allclose(chosen.mean(axis=0), 0.5, atol=0.06)  # four deviations
    assert np.array_equal(chosen_critics(settings, [3, 4, 5], 501, 7), chosen[500:507])
    assert np.array_equal(chosen_critics(settings, [4], 1, 9)[:, 0], chosen[:9, 1])


@pytest.mark.parametrize("kind", KINDS)
def test_threads_do_not_change_a_bit(kind: type[StackedAgent], monkeypatch: pytest.MonkeyPatch) -> None:
    one, _ = pair(kind, seeds=3, hidden=(24, 20))
    several = one.clone()
    one.train(20)
    monkeypatch.setattr(torch, "get_num_threads", lambda: 2)
    several.train(20)
    assert_equal(several, one, 0.0)


def test_a_subclass_that_changes_the_update_has_no_kernel() -> None:
    class Frozen(DDPG):
        def update(self, *arguments: Tensor, **_: object) -> dict[str, Tensor]:
            return {"critic_loss": torch.zeros(len(self.seeds))}

    class Renamed(DDPG):
        pass

    assert Frozen.kernel is None
    assert Renamed.kernel is DDPG.kernel
    agent, _ = pair(Frozen)
    before = agent.state_dict()
    agent.train(3)
    assert np.array_equal(agent.state_dict()["actor/weights"], before["actor/weights"])
