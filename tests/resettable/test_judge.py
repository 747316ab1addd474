"""The judge knows Gymnasium only: nothing is a success that a fresh environment does not grant."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from pbcs_ompl import EnvSpec, evaluate, make, plan
from pbcs_ompl.core.errors import CallbackFailed, NotVerified
from pbcs_ompl.resettable.judge import Judge
from pbcs_ompl.resettable.task import task_of


class Ring(gymnasium.Env):
    """Goal at (0.8, 0). The episode is truncated on a strip 0.35 < x < 0.5, unless |y| > 0.6."""

    action_space = spaces.Box(-0.1, 0.1, (2,), np.float32)
    observation_space = spaces.Box(-1, 1, (2,), np.float64)
    resets = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        type(self).resets += 1
        self.place = np.array((options or {}).get("start", [0.0, 0.0]), dtype=np.float64)
        return self.place.copy(), {}

    def step(self, action):
        assert action in self.action_space
        self.place = np.clip(self.place + action, -1, 1)
        out = bool(0.35 < self.place[0] < 0.5 and abs(self.place[1]) < 0.6)
        won = bool(np.hypot(self.place[0] - 0.8, self.place[1]) < 0.1)
        return self.place.copy(), float(won), won, out, {"is_success": won}


class RingState(Ring):
    def get_env_state(self):
        return self.place.copy()

    def set_env_state(self, state):
        self.place = np.array(state)


class Mover(Ring):
    """Its reset changes the options that it is given, those within them too."""

    def reset(self, *, seed=None, options=None):
        start = options.pop("start")
        start[0] -= 0.1
        return super().reset(seed=seed, options={"start": start})


class Wind(RingState):
    """Wind beyond x > 0.6 from NumPy's global generator, which no state holds."""

    def step(self, action):
        if self.place[0] > 0.6:
            self.place = self.place + np.random.uniform(-0.05, 0.05, 2)
        return super().step(action)


class Straight:
    """A controller that goes right."""

    def reset(self, count=None):
        self.count = count

    def act(self, observations):
        assert len(observations) == self.count
        return np.tile(np.array([0.1, 0.0], dtype=np.float32), (self.count, 1))


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    for name, entry in {"Ring": Ring, "RingState": RingState, "Wind": Wind}.items():
        monkeypatch.setitem(gymnasium.registry, f"{name}-v0",
                            gymnasium.envs.registration.EnvSpec(f"{name}-v0", entry_point=entry, max_episode_steps=200))


def executed(env, actions, seed):
    """What a user's loop sees: whether the goal was granted, and at which step the episode was over."""
    env.reset(seed=seed)
    for step, action in enumerate(actions):
        _, _, terminated, truncated, info = env.step(action)
        if info["is_success"] or terminated or truncated:
            return info["is_success"], step + 1
    return False, len(actions)


@pytest.mark.parametrize("planner", ["Ex", "RRTNH", "ESTAdapted", "RRT", "KPIECE1", "EST"])
@pytest.mark.parametrize("env_id", ["Ring-v0", "RingState-v0"])
def test_no_plan_continues_after_the_end_of_an_episode(env_id, planner):
    result = plan(env_id, planner, seed=0, max_transitions=3_000 if env_id == "Ring-v0" else 30_000)
    if env_id == "RingState-v0" and planner in ("Ex", "RRTNH"):
        assert result.solved, result.reason
    assert result.found == result.solved
    if result.solved:
        assert executed(gymnasium.make(env_id), result.trajectory.actions, 0) == (True, result.path_length)


@pytest.mark.parametrize("env", ["id", "spec", "environment", "model"])
def test_however_it_is_given_the_environment_is_fresh(env):
    given = {"id": "RingState-v0", "spec": EnvSpec("RingState-v0"), "environment": RingState(),
             "model": make("RingState-v0")}[env]
    result = plan(given, seed=1, max_transitions=30_000)
    assert result.solved
    assert result.replay_ok
    assert result.reason is None


def test_what_the_environment_does_not_grant_is_not_solved():
    result = plan("Wind-v0", seed=0, max_transitions=30_000)
    assert result.found
    assert not result.solved
    assert result.reason.startswith("the plan does not execute: differs from step ")
    assert result.replay_ok is False


def test_a_plan_longer_than_an_episode_is_not_solved_unless_the_limit_is_lifted():
    short = make("RingState-v0", max_episode_steps=12)
    assert short.max_episode_steps == short.episode_limit == 12
    assert not plan(short, seed=0, max_transitions=2_000).solved
    found = plan("RingState-v0", "RRT", seed=0, max_transitions=30_000, max_episode_steps=5)
    assert found.found
    assert not found.solved
    assert "ends an episode after 5" in found.reason
    assert plan("RingState-v0", "RRT", seed=0, max_transitions=30_000, max_episode_steps=1_000).solved


@pytest.mark.parametrize(("env_id", "steps"), [("Pendulum-v1", 200), ("MountainCarContinuous-v0", 999)])
def test_the_registered_limit_is_the_length_of_an_episode(env_id, steps):
    assert make(env_id).max_episode_steps == steps
    assert make(gymnasium.make(env_id)).max_episode_steps == steps
    assert make(gymnasium.make(env_id).unwrapped).episode_limit is None


def test_endings_are_counted():
    evaluation = evaluate(Straight(), "Ring-v0", episodes=7)
    assert evaluation.success_rate == 0.0
    assert evaluation.endings == {"truncated": 7}
    over = evaluate(Straight(), "Ring-v0", reset_options={"start": [0.55, 0.0]}, episodes=30)
    assert over.endings == {"goal": 30}
    assert over.steps_median == 2.0


def test_random_actions_do_not_depend_on_the_number_of_environments(monkeypatch):
    first = evaluate(Straight(), "Ring-v0", episodes=9, epsilon=0.5, seed=3)
    monkeypatch.setattr("pbcs_ompl.resettable.judge.SIDE_BY_SIDE", 2)
    assert evaluate(Straight(), "Ring-v0", episodes=9, epsilon=0.5, seed=3) == first


def test_a_copy_is_taken_before_anything_runs():
    env = RingState()
    make_env = task_of(env).make_env
    env.reset(seed=0)
    assert not hasattr(make_env(), "place")


def test_what_cannot_be_made_again_is_not_verified():
    class Locked(RingState):
        def __deepcopy__(self, memo):
            raise TypeError("no copies")

    result = plan(Locked(), seed=1, max_transitions=30_000)
    assert (result.found, result.solved, result.replay_ok) == (True, False, None)
    assert result.reason.startswith("not verified")
    with pytest.raises(NotVerified):
        Judge.of(make(Locked()))


def test_an_environment_that_raises_is_named():
    class Broken(RingState):
        def step(self, action):
            raise ZeroDivisionError("oh")

    with pytest.raises(CallbackFailed, match="ZeroDivisionError: oh"):
        Judge(*task_of(Broken())).execute(np.zeros((3, 2), np.float32), 0)


def test_the_judge_agrees_with_the_model():
    """Batched models are for search and training; what they say of a policy is what the judge says."""
    model = make("RingState-v0")
    controls = np.random.default_rng(0).uniform(-0.1, 0.1, (20, 40, 2)).astype(np.float32)
    states = np.repeat(model.initial_state(0)[None], 20, axis=0)
    success, going = np.zeros(20, bool), np.ones(20, bool)
    for step in range(40):
        outcome = model.transition(states, controls[:, step].astype(np.float64))
        success |= going & outcome.success
        going &= ~outcome.ended
        states = outcome.states
    judged = [Judge.of(model).execute(row, 0).success for row in controls]
    assert judged == success.tolist()


def test_a_reset_may_change_its_options():
    options = {"start": [0.7, 0.2]}
    found = plan(Mover(), "Ex", seed=0, reset_options=options, max_transitions=5000)
    assert found.solved
    assert options == {"start": [0.7, 0.2]}
    env = Mover()
    observation, _ = env.reset(options={"start": [0.7, 0.2]})
    assert found.trajectory.states[0][:2].tolist() == observation.tolist()
    for action in found.trajectory.actions:
        *_, info = env.step(action)
    assert info["is_success"]
