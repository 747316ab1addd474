"""Controls become members of the action space, every integer is as likely as the others, and nothing is lost."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl import plan
from pbcs_ompl.core.errors import UnsupportedSpace
from pbcs_ompl.resettable.actions import ActionMap

SPACES = [
    spaces.Box(-0.1, 0.3, (2,), np.float64), spaces.Box(-0.1, 0.3, (2,), np.float32),
    spaces.Box(np.array([-1, 0]), np.array([1, 7]), dtype=np.int64), spaces.Box(0, 255, (3,), np.uint8),
    spaces.Discrete(3), spaces.Discrete(4, start=-2), spaces.MultiDiscrete([2, 5]), spaces.MultiBinary(3),
]


@pytest.mark.parametrize("space", SPACES, ids=str)
@given(data=st.data())
def test_actions_are_members_and_come_back(space: gymnasium.Space, data: st.DataObject) -> None:
    actions = ActionMap.of(space)
    fractions = np.array(data.draw(st.lists(st.floats(0, 1), min_size=len(actions.low), max_size=len(actions.low))))
    controls = (actions.low + fractions * (actions.high - actions.low))[None]
    made = actions.to_actions(controls)
    assert made[0] in space
    again = actions.to_actions(actions.to_controls(made))
    assert again.tobytes() == made.tobytes()
    assert actions.to_controls(made).shape == controls.shape


@pytest.mark.parametrize("space", SPACES[2:], ids=str)
def test_integers_are_equally_likely(space: gymnasium.Space) -> None:
    actions, rng = ActionMap.of(space), np.random.default_rng(0)
    drawn = actions.to_actions(rng.uniform(actions.low, actions.high, (40_000, len(actions.low)))).reshape(40_000, -1)
    for entry, low, high in zip(drawn.T, actions.first, actions.last, strict=True):
        values, counts = np.unique(entry, return_counts=True)
        assert values.tolist() == list(range(int(low), int(high) + 1))
        expected = 40_000 / len(values)
        assert (np.abs(counts - expected) < 6 * np.sqrt(expected)).all()


@pytest.mark.parametrize("space", [spaces.Text(3), spaces.Box(-np.inf, np.inf, (1,)), spaces.Box(-1, 1, (2, 2))])
def test_other_spaces_are_refused(space: gymnasium.Space) -> None:
    with pytest.raises(UnsupportedSpace, match="expected"):
        ActionMap.of(space)


class Notches(gymnasium.Env):
    """A motor whose actions are whole notches; the goal needs steps in both directions."""

    observation_space = spaces.Box(-50, 50, (2,), np.float64)

    def __init__(self, space: gymnasium.Space) -> None:
        self.action_space = space
        self.drift = 0.0 if isinstance(space, spaces.Box) else 0.6

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = np.zeros(2)
        return self.place.copy(), {}

    def step(self, action):
        assert action in self.action_space
        move = np.broadcast_to(np.asarray(action, dtype=np.float64), 2)
        self.place = np.clip(self.place + move - self.drift, -50, 50)
        won = bool((self.place > 1.5).all())
        return self.place.copy(), float(won), won, False, {"is_success": won}

    def get_env_state(self):
        return self.place.copy()

    def set_env_state(self, state):
        self.place = np.array(state)


@pytest.mark.parametrize("planner", ["Ex", "RRTNH", "RRT", "KPIECE1"])
@pytest.mark.parametrize("space", [spaces.Box(-1, 1, (2,), np.int64), spaces.Discrete(3), spaces.MultiDiscrete([3, 3]),
                                   spaces.Box(-1, 1, (2,), np.float32)], ids=str)
def test_plans_hold_the_actions_as_they_are_executed(planner: str, space: gymnasium.Space) -> None:
    result = plan(Notches(space), planner, seed=0, max_transitions=20_000)
    assert result.solved, result.reason
    env = Notches(space)
    env.reset(seed=0)
    for action, state in zip(result.trajectory.actions, result.trajectory.states[1:], strict=True):
        assert action in space
        observation, _, won, _, _ = env.step(action)
        np.testing.assert_array_equal(observation, state[:2])
    assert won


def test_random_actions_are_those_of_numpys_uniform():
    space = spaces.Box(np.array([-0.3, 2.0, -7.0]), np.array([0.1, 2.5, 100.0]), dtype=np.float64)
    ours, numpys, actions = np.random.default_rng(5), np.random.default_rng(5), ActionMap.of(space)
    for _ in range(1_000):
        np.testing.assert_array_equal(actions.draw(ours), numpys.uniform(space.low, space.high))
