"""The end of an episode with a positive reward is a goal only where no other step is rewarded."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.known_goal import check_goal


class Line(gymnasium.Env[Any, Any]):
    """A point on [-1, 1] that is rewarded in every step, and ends at either end."""

    observation_space = Box(-np.inf, np.inf, (1,), np.float64)
    action_space = Box(-0.1, 0.1, (1,), np.float64)

    def __init__(self, reward: float, report: bool):
        self.reward, self.report, self.place = reward, report, np.zeros(1)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.place = np.zeros(1)
        return self.place.copy(), {}

    def step(self, action: Any) -> Any:
        self.place = self.place + action
        ended = bool(abs(self.place[0]) > 1.0)
        info = {"is_success": bool(self.place[0] > 1.0)} if self.report else {}
        return self.place.copy(), 1.0 if ended else self.reward, ended, False, info

    def get_env_state(self) -> Any:
        return self.place

    def set_env_state(self, state: Any) -> None:
        self.place = np.array(state)


@pytest.mark.parametrize(("reward", "report", "known"), [(0.5, False, False), (0.0, False, True), (-1.0, False, True),
                                                         (0.5, True, True)])
def test_rewards_of_all_steps_hide_the_goal_unless_it_is_reported(reward: float, report: bool, known: bool) -> None:
    model = make(Line(reward, report))
    if known:
        check_goal(model)
        assert pbcs_ompl.plan(model, seed=0, max_transitions=20_000).solved
        return
    for search in (pbcs_ompl.plan, pbcs_ompl.train):
        with pytest.raises(InvalidOption, match=r"reports no success, .* --goal"):
            search(model)
    assert pbcs_ompl.plan(make(Line(reward, report), goal="obs[0]>1"), seed=0, max_transitions=20_000).solved


def test_a_distance_to_the_goal_makes_it_known() -> None:
    env: Any = Line(0.5, report=False)
    env.goal_distance, env.goal_threshold = lambda states: 2.0 - states[:, 0], 1.0
    check_goal(make(env))


def test_a_balanced_pole_is_not_solved_by_its_fall(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "--env", "CartPole-v1"]) == 2
    printed = capsys.readouterr().err
    assert "goal      not known" in printed
    assert "CartPole-v1 reports no success" in printed
    with pytest.raises(InvalidOption, match="CartPole-v1 reports no success"):
        pbcs_ompl.compare(["Rides"], "CartPole-v1", seeds=1)


def test_ends_without_a_reward_are_pointed_out(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["plan", "--env", "Acrobot-v1", "--max-transitions", "3000", "--no-pictures", "--out"]
    assert main([*arguments, str(tmp_path / "a")]) == 1
    printed = capsys.readouterr()
    assert "goal      the end of an episode with a positive reward" in printed.err
    assert "say so: --goal 'terminated>0'" in printed.out
    assert main([*arguments, str(tmp_path / "b"), "--goal", "terminated>0"]) == 0
