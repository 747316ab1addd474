"""Laws of every registered agent, in an action box that is neither symmetric nor a cube."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import NonFiniteData, StackedAgent
from pbcs_ompl.core import registry
from pbcs_ompl.core.errors import InvalidOption, Mismatch, UnknownName, UnsupportedSpace
from pbcs_ompl.resettable import make as open_model
from pbcs_ompl.skills import SkillChain, train

LOW, HIGH = [-1.0, 0.0], [0.5, 10.0]


@pytest.fixture(scope="module", params=registry.names("agent"))
def entry(request):
    """The class of a registered agent."""
    return registry.load("agent", request.param)


UPDATES = 50
"""Rounding differs between a stack and a single agent, and between processors; updates amplify it."""


def make(entry, *seeds, **changes):
    settings = entry.settings_type.from_preset("fast", **{"hidden": (24, 20), "batch_size": 32, **changes})
    return entry(3, LOW, HIGH, settings=settings, seeds=seeds)


def data(seed, count=200):
    rng = np.random.default_rng(seed)
    return [rng.normal(size=(count, 3)), rng.uniform(LOW, HIGH, (count, 2)), rng.normal(size=count),
            rng.normal(size=(count, 3)), rng.random(count) < 0.2]


def fill(agent, *seeds):
    agent.add_transitions(*(np.stack(field) for field in zip(*(data(seed) for seed in seeds), strict=True)))
    return agent


def probe(agent):
    """What a user can see of each seed [S, ...]: actions and values on fixed observations."""
    rng = np.random.default_rng(99)
    observations, actions = rng.normal(size=(50, 3)), rng.uniform(LOW, HIGH, (50, 2))
    count = len(agent.seeds)
    observations, actions = (np.stack([field] * count) for field in (observations, actions))
    return np.concatenate([agent.act(observations), agent.value(observations, actions)[..., None]], axis=2)


@pytest.mark.parametrize("preset", ["fast", "thesis"])
def test_it_has_settings_and_both_presets(entry, preset):
    assert issubclass(entry, StackedAgent)
    settings = entry.settings_type.from_preset(preset, discount=0.5)
    assert settings.discount == 0.5
    if preset == "fast":
        assert entry.settings_type.from_preset("fast") == entry.settings_type()
    with pytest.raises(InvalidOption, match="'polyak'"):
        entry.settings_type.from_preset(preset, poliak=0.9)


def test_no_algorithm_inherits_from_another(entry):
    assert entry.__bases__ == (StackedAgent,)


@pytest.mark.parametrize("layer_norm", [False, True])
def test_a_stack_equals_separate_agents(entry, layer_norm):
    stack = fill(make(entry, 5, 6, 7, layer_norm=layer_norm), 0, 1, 2)
    losses = stack.train(UPDATES)
    for index, seed in enumerate((5, 6, 7)):
        alone = fill(make(entry, seed, layer_norm=layer_norm), index)
        own = alone.train(UPDATES)
        assert stack.policy(index).to_arrays().keys() == alone.policy().to_arrays().keys()
        for name, array in stack.policy(index).to_arrays().items():
            np.testing.assert_allclose(array, alone.policy().to_arrays()[name], atol=1e-5)
        np.testing.assert_allclose(probe(stack)[index], probe(alone)[0], atol=2e-4)
        for name in losses:
            np.testing.assert_allclose(losses[name][index], own[name][0], rtol=1e-4)


@pytest.mark.parametrize("layer_norm", [False, True])
def test_kernels_make_the_updates_of_autograd(entry, layer_norm):
    reference = type("Reference", (entry,), {"gradients": {}})
    fast, plain = (fill(make(kind, 5, 6, layer_norm=layer_norm), 0, 1) for kind in (entry, reference))
    mine, theirs = fast.train(100), plain.train(100)
    for name in mine:
        np.testing.assert_allclose(mine[name], theirs[name], rtol=1e-4)
    for name, array in plain.state_dict().items():
        np.testing.assert_allclose(fast.state_dict()[name], array, atol=1e-5, err_msg=name)


def test_changing_one_seed_leaves_the_others_bit_equal(entry):
    first, second = fill(make(entry, 5, 6, 7), 0, 1, 2), fill(make(entry, 5, 8, 7), 0, 9, 2)
    for agent in (first, second):
        agent.train(50)
    mine, theirs = probe(first), probe(second)
    assert np.array_equal(mine[[0, 2]], theirs[[0, 2]])
    assert not np.array_equal(mine[1], theirs[1])


def test_saved_and_loaded_agents_continue_bit_for_bit(entry):
    first = fill(make(entry, 1, 2), 3, 4)
    first.train(31)
    first.explore(np.zeros((2, 5, 3)))
    second = make(entry, 1, 2)
    second.load_state_dict({name: array.copy() for name, array in first.state_dict().items()})
    drawn = []
    for agent in (first, second):
        agent.train(7)
        fill(agent, 5, 6)
        agent.train(20)
        drawn.append(agent.explore(np.zeros((2, 5, 3))))
    assert np.array_equal(*drawn)
    mine, theirs = first.state_dict(), second.state_dict()
    assert mine.keys() == theirs.keys()
    for name in mine:
        assert np.array_equal(mine[name], theirs[name]), name
    assert first.num_updates == 58


def test_a_clone_is_independent(entry):
    agent = fill(make(entry, 1), 3)
    agent.train(5)
    copy, before = agent.clone(), probe(agent)
    copy.train(5)
    assert np.array_equal(probe(agent), before)
    agent.train(5)
    assert np.array_equal(probe(agent), probe(copy))


@pytest.mark.parametrize("layer_norm", [False, True])
def test_a_part_of_a_stack_trains_as_it_would_have_in_the_whole(entry, layer_norm):
    whole = fill(make(entry, 5, 6, 7, 8, layer_norm=layer_norm), 0, 1, 2, 3)
    whole.train(21)
    whole.explore(np.zeros((4, 5, 3)))
    part = whole.clone([3, 1])
    assert part.seeds == (8, 6)
    assert np.array_equal(probe(part), probe(whole)[[3, 1]])
    fill(whole, 10, 11, 12, 13).train(40)
    fill(part, 13, 11).train(40)
    np.testing.assert_allclose(probe(part), probe(whole)[[3, 1]], atol=1e-5)
    explored = whole.explore(np.ones((4, 5, 3)))[[3, 1]]
    np.testing.assert_allclose(part.explore(np.ones((2, 5, 3))), explored, atol=1e-5)


def test_updates_do_not_depend_on_how_many_are_made_in_one_call(entry):
    first, second = fill(make(entry, 1), 3), fill(make(entry, 1), 3)
    first.train(20)
    for count in (1, 6, 13):
        second.train(count)
    assert np.array_equal(probe(first), probe(second))


def test_actions_fill_the_box_and_the_policy_is_a_snapshot_of_them(entry):
    agent = fill(make(entry, 1, 2), 3, 4)
    agent.train(10)
    observations = np.random.default_rng(0).normal(size=(2, 300, 3))
    for actions in (agent.act(observations), agent.explore(observations)):
        assert actions.shape == (2, 300, 2)
        assert actions.dtype == np.float64
        assert ((actions >= LOW) & (actions <= HIGH)).all()
    for index in range(2):
        policy = agent.policy(index)
        np.testing.assert_allclose(policy.act(observations[index]), agent.act(observations)[index], atol=1e-5)
    before = policy.act(observations[1])
    agent.train(5)
    assert np.array_equal(policy.act(observations[1]), before)


@pytest.mark.parametrize(("low", "high", "match"), [
    ([-1.0], [np.inf], "RescaleAction"), ([1.0], [1.0], "low < high"), ([-1.0], [1.0, 2.0], "shapes")])
def test_impossible_boxes_are_refused(entry, low, high, match):
    with pytest.raises(UnsupportedSpace, match=match):
        entry(2, low, high)


def test_unavailable_devices_are_named(entry):
    with pytest.raises(InvalidOption, match="abacus"):
        entry(2, [-1.0], [1.0], device="abacus")
    if not torch.cuda.is_available():
        with pytest.raises(InvalidOption, match="no CUDA device"):
            entry(2, [-1.0], [1.0], device="cuda")


@pytest.mark.parametrize("wrong", [
    {"discount": 1.0}, {"discount": -0.1}, {"discount": float("nan")}, {"discount": "high"}, {"hidden": ()},
    {"hidden": 64}, {"batch_size": 0}, {"batch_size": 2.5}, {"layer_norm": 1}, {"polyak": 2.0}, {"polyak": True}])
def test_settings_out_of_range_are_named(entry, wrong):
    with pytest.raises(InvalidOption, match=next(iter(wrong))):
        entry.settings_type(**wrong)


def test_bad_transitions_are_refused_and_none_is_added(entry):
    agent = make(entry, 1)
    fields = [field[None] for field in data(0, 10)]
    wrong = [*fields[:1], fields[1][..., :1], *fields[2:]]
    with pytest.raises(InvalidOption, match=r"actions have the shape \(1, 10, 1\), expected \(1, 10, 2\)"):
        agent.add_transitions(*wrong)
    fields[0][0, 3, 1] = np.nan
    with pytest.raises(NonFiniteData, match="observations hold NaN or infinity, after update 0"):
        agent.add_transitions(*fields)
    assert agent.replay_sizes.tolist() == [0]
    with pytest.raises(InvalidOption, match="no transitions"):
        agent.train(1)


def test_a_nan_in_a_loss_names_seed_and_update(entry):
    agent = fill(make(entry, 8, 9), 0, 1)
    agent.train(3)
    agent.actor.target.flat.fill_(float("nan"))
    agent.actor.weights.flat.fill_(float("nan"))
    with pytest.raises(NonFiniteData, match="loss of seed 8 is nan in update 4"):
        agent.train(10)


def test_a_state_of_another_agent_is_refused(entry):
    state = fill(make(entry, 1), 3).state_dict()
    with pytest.raises(Mismatch, match="seeds"):
        make(entry, 2).load_state_dict(state)
    with pytest.raises(Mismatch, match="other settings"):
        make(entry, 1, hidden=(8,)).load_state_dict(state)
    with pytest.raises(Mismatch, match="missing"):
        make(entry, 1).load_state_dict({name: state[name] for name in state if name != "actor/mean"})


def test_it_solves_a_bandit_and_values_it(entry):
    """One step, reward -(a - 0.3)^2: the actor must find 0.3, the critic the rewards."""
    agent = entry(1, [-1.0], [1.0], settings=entry.settings_type(hidden=(24, 24), batch_size=32), seeds=(0, 1))
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 2000, 1))
    zeros = np.zeros((2, 2000, 1))
    agent.add_transitions(zeros, actions, -np.square(actions[..., 0] - 0.3), zeros, np.ones((2, 2000)))
    agent.train(1500)
    np.testing.assert_allclose(agent.act(np.zeros((2, 1, 1))), 0.3, atol=0.15)
    probed = np.linspace(-0.9, 0.9, 7)[None, :, None].repeat(2, axis=0)
    values = agent.value(np.zeros((2, 7, 1)), probed)
    np.testing.assert_allclose(values, -np.square(probed[..., 0] - 0.3), atol=0.15)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name == "sac" else [pytest.mark.slow])
                                  for name in registry.names("agent")])
def test_it_trains_the_skills_of_the_2x2_maze(name, tmp_path):
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs={"size": 2}, agent=name, max_transitions=400_000,
                   out=tmp_path / "run")
    assert result.solved
    chain, model = SkillChain.load(tmp_path / "run" / "chain"), open_model("pbcs/Maze-v0", {"size": 2})
    np.testing.assert_array_equal(chain.rollout(model, model.initial_state(0)),
                                  result.chain.rollout(model, model.initial_state(0)))


@pytest.mark.parametrize(("options", "error", "match"), [
    ({"device": "abacus"}, InvalidOption, "abacus"), ({"agent": "tdd3"}, UnknownName, "'td3'"),
    ({"agent": "json:JSONDecoder"}, InvalidOption, "lacks act"), ({"agent": "sac", "agent_settings": {"temprature": 1}},
                                                                  InvalidOption, "'temperature'")])
def test_a_training_that_cannot_begin_leaves_no_folder(options, error, match, tmp_path):
    with pytest.raises(error, match=match):
        train("pbcs/Maze-v0", method="pbcs", env_kwargs={"size": 2}, out=tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_equals_the_cpu(entry):
    settings = entry.settings_type(hidden=(24, 20), batch_size=32)
    agents = [fill(entry(3, LOW, HIGH, settings=settings, seeds=(1, 2), compile=False, device=device), 3, 4)
              for device in ("cpu", "cuda")]
    for agent in agents:
        agent.train(20)
    np.testing.assert_allclose(probe(agents[0]), probe(agents[1]), atol=1e-3)
    agents[0].load_state_dict(agents[1].state_dict())
    drawn = [agent.explore(np.zeros((2, 5, 3))) for agent in agents]
    np.testing.assert_allclose(*drawn, atol=1e-4)


@pytest.mark.slow
def test_torch_compile_equals_eager_torch(entry):
    settings = entry.settings_type(hidden=(24, 20), batch_size=32)
    agents = [fill(entry(3, LOW, HIGH, settings=settings, seeds=(1, 2), compile=compile), 3, 4)
              for compile in (True, False)]
    for agent in agents:
        agent.train(50)
    np.testing.assert_allclose(probe(agents[0]), probe(agents[1]), atol=1e-4)
