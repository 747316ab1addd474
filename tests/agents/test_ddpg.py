"""DDPG: its losses from their equations, every way of running it, saving, learning; see also tests/contracts/."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import DDPG, DDPGSettings, NonFiniteData
from pbcs_ompl.agents.networks import TrainedNetwork
from pbcs_ompl.agents.update import Compile

SMALL = DDPGSettings(hidden=(24, 20), batch_size=32)
LOW, HIGH = [-1.0, 0.0], [0.5, 10.0]


def make(*seeds: int, compile: Compile = "auto", settings: DDPGSettings = SMALL) -> DDPG:
    return DDPG(3, LOW, HIGH, settings=settings, seeds=seeds, compile=compile)


def data(seed: int, count: int = 200) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.normal(size=(count, 3)), rng.uniform(LOW, HIGH, (count, 2)), rng.normal(size=count),
            rng.normal(size=(count, 3)), rng.random(count) < 0.2]


def fill(agent: DDPG, *seeds: int) -> DDPG:
    agent.add_transitions(*(np.stack(field) for field in zip(*(data(seed) for seed in seeds), strict=True)))
    return agent


def weights(agent: DDPG, seed_index: int) -> np.ndarray:
    """All of one seed's parameters, targets and moments, concatenated."""
    state = agent.state_dict([seed_index])
    return np.concatenate([state[name] for name in sorted(state) if name.startswith(("actor/", "critic/"))])


def numpy_layers(network: TrainedNetwork) -> list[tuple[np.ndarray, np.ndarray]]:
    return [(layer.weight[0].double().numpy(), layer.bias[0, 0].double().numpy()) for layer in network.weights.layers]


def run_numpy(layers: list, inputs: np.ndarray) -> np.ndarray:
    for weight, bias in layers[:-1]:
        inputs = np.maximum(inputs @ weight + bias, 0.0)
    return inputs @ layers[-1][0] + layers[-1][1]


@pytest.mark.parametrize("compile", ["auto", False])
def test_first_losses_equal_the_equations_row_by_row(compile: Compile) -> None:
    """Eqs. 1.2 and 1.3 of [Matheron2020], in float64; targets equal the networks before the first update."""
    agent = fill(make(3, compile=compile), 0)
    rows = agent.clone().replay.sample(1, SMALL.batch_size)[0, 0].double().numpy()
    actor, critic = numpy_layers(agent.actor), numpy_layers(agent.critic)
    half, centre = (np.array(HIGH) - LOW) / 2, (np.array(HIGH) + LOW) / 2
    errors = []
    for row in rows:
        state, action, reward, not_done, next_state = row[:3], row[3:5], row[5], row[6], row[7:]
        next_action = centre + half * np.tanh(run_numpy(actor, next_state))
        target = reward + SMALL.discount * not_done * run_numpy(critic, np.r_[next_state, next_action])[0]
        errors.append(run_numpy(critic, np.r_[state, action])[0] - target)
    losses = agent.train(1)
    np.testing.assert_allclose(losses["critic_loss"], np.mean(np.square(errors)), rtol=1e-5)
    updated = numpy_layers(agent.critic)
    values = [run_numpy(updated, np.r_[row[:3], centre + half * np.tanh(run_numpy(actor, row[:3]))])[0]
              for row in rows]
    np.testing.assert_allclose(losses["actor_loss"], -np.mean(values), rtol=1e-4)


@pytest.mark.parametrize("compile", ["auto", False])
def test_changing_one_seed_leaves_the_others_bit_equal(compile: Compile) -> None:
    first = fill(make(5, 6, 7, compile=compile), 0, 1, 2)
    second = fill(make(5, 8, 7, compile=compile), 0, 9, 2)
    first.train(50)
    second.train(50)
    assert np.array_equal(weights(first, 0), weights(second, 0))
    assert np.array_equal(weights(first, 2), weights(second, 2))
    assert not np.array_equal(weights(first, 1), weights(second, 1))


def test_the_kernel_equals_eager_torch() -> None:
    kernel, eager = fill(make(1, 2), 3, 4), fill(make(1, 2, compile=False), 3, 4)
    mine, theirs = kernel.train(200), eager.train(200)
    for index in range(2):
        np.testing.assert_allclose(weights(kernel, index), weights(eager, index), atol=1e-5)
    for name in mine:
        np.testing.assert_allclose(mine[name], theirs[name], rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("layer_norm", [False, True])
def test_torch_compile_equals_eager_torch(layer_norm: bool) -> None:
    settings = DDPGSettings(hidden=(24, 20), batch_size=32, layer_norm=layer_norm)
    compiled = fill(make(1, 2, compile=True, settings=settings), 3, 4)
    eager = fill(make(1, 2, compile=False, settings=settings), 3, 4)
    compiled.train(50)  # more updates amplify how this processor rounds
    eager.train(50)
    np.testing.assert_allclose(weights(compiled, 1), weights(eager, 1), atol=1e-5)


def test_a_failed_compilation_continues_eagerly_with_one_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise torch._dynamo.exc.BackendCompilerFailed(fail, RuntimeError("no compiler"), None)

    monkeypatch.setattr(torch, "compile", lambda function, **_: fail)
    agent, eager = fill(make(1, compile=True), 3), fill(make(1, compile=False), 3)
    with pytest.warns(RuntimeWarning, match="running uncompiled") as caught:
        agent.train(5)
    assert len(caught) == 1
    eager.train(5)
    assert np.array_equal(weights(agent, 0), weights(eager, 0))


@pytest.mark.parametrize("compile", ["auto", False])
def test_saved_and_loaded_agents_continue_bit_for_bit(compile: Compile) -> None:
    first = fill(make(1, 2, compile=compile), 3, 4)
    first.train(30)
    second = make(1, 2, compile=compile)
    second.load_state_dict({name: array.copy() for name, array in first.state_dict().items()})
    for agent in (first, second):
        agent.train(7)
        fill(agent, 5, 6)
        agent.train(20)
    mine, theirs = first.state_dict(), second.state_dict()
    assert mine.keys() == theirs.keys()
    for name in mine:
        assert np.array_equal(mine[name], theirs[name]), name
    assert first.num_updates == 57


def test_actions_stay_in_an_asymmetric_box_and_reach_its_corners() -> None:
    agent = make(1, 2)
    for sign, corner in ((1.0, HIGH), (-1.0, LOW)):
        agent.actor.weights.layers[-1].bias.fill_(40.0 * sign)
        observations = np.random.default_rng(0).normal(size=(2, 30, 3))
        actions = agent.act(observations)
        assert actions.dtype == np.float64
        assert ((actions >= LOW) & (actions <= HIGH)).all()
        np.testing.assert_allclose(actions, np.broadcast_to(corner, actions.shape), atol=1e-5)
        alone = agent.policy().act(observations[0])
        assert ((alone >= LOW) & (alone <= HIGH)).all()


@pytest.mark.parametrize("compile", ["auto", False])
def test_a_nan_in_a_loss_names_seed_and_update(compile: Compile) -> None:
    agent = fill(make(8, 9, compile=compile), 0, 1)
    agent.train(3)
    agent.critic.weights.layers[0].weight[1, 0, 0] = float("nan")
    with pytest.raises(NonFiniteData, match="critic_loss of seed 9 is nan in update 4"):
        agent.train(10)


def test_it_learns_to_reach_a_point_on_a_line() -> None:
    """Steps of at most 0.2 on [-1, 1]; reward -1 a step until |x| < 0.1: at most six steps from anywhere."""
    agent = DDPG(1, [-0.2], [0.2], settings=DDPGSettings(hidden=(32, 32)), seeds=(0, 1))
    rng = np.random.default_rng(1)
    before, actions = rng.uniform(-1, 1, (2, 3000, 1)), rng.uniform(-0.2, 0.2, (2, 3000, 1))
    after = np.clip(before + actions, -1, 1)
    success = np.abs(after[..., 0]) < 0.1
    agent.add_transitions(before, actions, np.where(success, 0.0, -1.0), after, success)
    agent.train(4000)
    places = np.linspace(-1, 1, 21)[None, :, None].repeat(2, axis=0)
    done = np.abs(places[..., 0]) < 0.1
    for _ in range(8):
        places = np.where(done[..., None], places, np.clip(places + agent.act(places), -1, 1))
        done |= np.abs(places[..., 0]) < 0.1
    assert done.mean() > 0.9
