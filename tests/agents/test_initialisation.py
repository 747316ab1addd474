"""Laws of new networks, and the ways in which networks take observations and actions."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import DDPG, SAC, TD3, DDPGArgmax, DDPGRegression, DDPGSettings, StackedAgent
from pbcs_ompl.agents.initialisation import INITIALISATIONS
from pbcs_ompl.agents.kernels.gradients import GRADIENTS

ALGORITHMS = [DDPG, TD3, SAC, DDPGArgmax, DDPGRegression]
LOW, HIGH = np.array([-0.1, 2.0]), np.array([0.1, 6.0])


def agent(kind: type[StackedAgent], *seeds: int, **changes) -> StackedAgent:
    settings = kind.settings_type(hidden=(24, 20), batch_size=16, **changes)
    return kind(3, LOW, HIGH, settings=settings, seeds=seeds)


def data(*seeds: int, count: int = 150) -> list[np.ndarray]:
    """Transitions whose observations lie far from 0 and 1."""
    parts = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        parts.append([rng.normal(20.0, 5.0, (count, 3)), rng.uniform(LOW, HIGH, (count, 2)), rng.normal(size=count),
                      rng.normal(20.0, 5.0, (count, 3)), rng.random(count) < 0.2])
    return [np.stack(field) for field in zip(*parts, strict=True)]


@pytest.mark.parametrize("initialisation", INITIALISATIONS)
@pytest.mark.parametrize("late", ["plain", "baselines"])
def test_new_layers_obey_their_law(initialisation: str, late: str) -> None:
    new = DDPG(3, LOW, HIGH, seeds=range(20), settings=DDPGSettings((200, 100), initialisation=initialisation,
                                                                     inputs=late))
    for trained, shapes in ((new.actor, [(3, 200), (200, 100), (100, 2)]),
                            (new.critic, [(5, 200), (200, 100), (100, 1)] if late == "plain" else
                             [(3, 200), (202, 100), (100, 1)])):
        layers = trained.weights.layers
        assert [tuple(layer.weight.shape[1:]) for layer in layers] == shapes
        for layer, (fan_in, fan_out) in zip(layers, shapes, strict=True):
            bound = {"torch": fan_in**-0.5}.get(initialisation, (6.0 / (fan_in + fan_out)) ** 0.5)
            if initialisation == "baselines" and layer is layers[-1]:
                bound = 3e-3
            assert 0.97 * bound < layer.weight.abs().max() <= bound
            assert layer.weight.mean().abs() < 0.1 * bound
            assert layer.bias.abs().max() <= (bound if initialisation == "torch" else 0.0)


def test_without_biases_the_first_action_at_zero_is_the_middle_of_the_box() -> None:
    new = DDPG.settings_type.from_preset("thesis", hidden=[24, 20])
    actions = DDPG(3, LOW, HIGH, settings=new, seeds=(1, 2)).act(np.zeros((2, 1, 3)))
    np.testing.assert_allclose(actions, np.broadcast_to([0.0, 4.0], (2, 1, 2)), atol=1e-12)


@pytest.mark.parametrize("kind", ALGORITHMS)
@pytest.mark.parametrize("changes", [{"initialisation": "glorot"},
                                     {"initialisation": "baselines", "inputs": "baselines"},
                                     {"inputs": "baselines", "layer_norm": True}], ids=str)
def test_a_stack_of_any_law_and_inputs_equals_its_agents_alone(kind, changes: dict) -> None:
    together = agent(kind, 3, 4, **changes)
    together.add_transitions(*data(0, 1))
    together.train(20)
    for index, seed in enumerate((3, 4)):
        alone = agent(kind, seed, **changes)
        alone.add_transitions(*data(index))
        alone.train(20)
        observations = data(9)[0]
        mine = together.act(np.repeat(observations, 2, axis=0))[index]
        np.testing.assert_allclose(mine, alone.act(observations)[0], atol=1e-4)
        np.testing.assert_allclose(together.policy(index).act(observations[0]), mine, atol=1e-4)


@pytest.mark.parametrize("kind", ALGORITHMS)
@pytest.mark.parametrize("changes", [{"initialisation": "glorot"},
                                     {"initialisation": "baselines", "inputs": "baselines", "layer_norm": True}],
                         ids=str)
def test_every_way_of_training_equals_autograd(kind, changes: dict, monkeypatch: pytest.MonkeyPatch) -> None:
    quick = agent(kind, 3, 4, **changes)
    quick.add_transitions(*data(0, 1))
    slow = quick.clone()
    monkeypatch.setattr(slow, "gradients", {}, raising=False)
    slow.compile = False
    assert quick.gradients is GRADIENTS
    quick.train(30)
    slow.train(30)
    for name, values in slow.state_dict().items():
        np.testing.assert_allclose(quick.state_dict()[name], values, rtol=2e-3, atol=2e-4, err_msg=name)


def test_normalised_inputs_do_not_depend_on_units() -> None:
    """The same data in other units of observations and actions train the same networks."""
    small, large = (DDPG(3, factor * LOW, factor * HIGH, seeds=(5,), settings=DDPGSettings(
        (24, 20), batch_size=16, inputs="baselines")) for factor in (1.0, 10.0))
    observations, actions, rewards, following, terminals = data(2)
    small.add_transitions(observations, actions, rewards, following, terminals)
    large.add_transitions(10 * observations, 10 * actions, rewards, 10 * following, terminals)
    small.train(20)
    large.train(20)
    # The prior count of the deviation, 0.01, does not scale.
    np.testing.assert_allclose(10 * small.act(observations), large.act(10 * observations), rtol=5e-3)
    np.testing.assert_allclose(small.value(observations, actions), large.value(10 * observations, 10 * actions),
                               atol=5e-3)


def test_running_means_and_deviations_are_those_of_the_data() -> None:
    one = agent(DDPG, 3, inputs="baselines")
    observations = np.concatenate([data(seed)[0] for seed in range(40)], axis=1)
    for part in np.split(observations, 8, axis=1):
        some = np.zeros(part.shape[:2])
        one.add_transitions(part, np.broadcast_to(LOW, (*some.shape, 2)), some, part, some)
    seen = one.observed(observations).numpy()
    np.testing.assert_allclose(seen.mean(axis=1), 0.0, atol=1e-3)
    np.testing.assert_allclose(seen.std(axis=1), 1.0, atol=1e-3)


def test_masked_transitions_are_not_seen() -> None:
    one, other = agent(DDPG, 3, inputs="baselines"), agent(DDPG, 3, inputs="baselines")
    parts = data(0)
    mask = np.arange(150)[None] < 100
    one.add_transitions(*parts, mask=mask)
    other.add_transitions(*(part[:, :100] for part in parts))
    assert torch.equal(one.observed(parts[0]), other.observed(parts[0]))


@pytest.mark.parametrize("sizes", [(3, 24, 20, 1), (3, 9, 1)])
def test_shapes_hold_all_inputs(sizes: tuple[int, ...]) -> None:
    from pbcs_ompl.agents.initialisation import layer_shapes

    plain = layer_shapes(sizes, 0)
    assert plain == list(pairwise(sizes))
    late = layer_shapes(sizes, 2)
    assert sum(fan_in for fan_in, _ in late) == sum(fan_in for fan_in, _ in plain)
