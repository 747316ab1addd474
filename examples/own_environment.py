"""What does an environment of my own need to be planned in? A puck on a table shows it.

    python examples/own_environment.py
    pbcs plan --env examples.own_environment:Puck-v0
"""

import gymnasium
import numpy as np
from gymnasium.spaces import Box

import pbcs_ompl

GOAL = np.array([0.9, 0.9])


class Puck(gymnasium.Env):
    """State and observation: x, y, vx, vy. Action: the change of the velocity in one step."""

    # What planners know beside Gymnasium's spaces; the last two: what to explore, and the goal in pictures.
    state_low = np.array([0.0, 0.0, -0.1, -0.1])
    state_high = np.array([1.0, 1.0, 0.1, 0.1])
    goal_threshold = 0.1
    feature_dims = (0, 1)
    goal_circle = (*GOAL.tolist(), goal_threshold)

    def __init__(self) -> None:
        self.action_space = Box(-0.02, 0.02, (2,), np.float64)
        self.observation_space = Box(self.state_low, self.state_high, dtype=np.float64)
        self._state = np.zeros(4)

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        self._state = np.array([0.1, 0.1, 0.0, 0.0])
        return self._state.copy(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        velocity = np.clip(self._state[2:] + action, -0.1, 0.1)
        position = self._state[:2] + velocity
        velocity = np.where((position < 0) | (position > 1), 0.0, velocity)  # the edge stops the puck
        self._state = np.concatenate([np.clip(position, 0, 1), velocity])
        success = bool(self.goal_distance(self._state[None])[0] < self.goal_threshold)
        return self._state.copy(), float(success), success, False, {"is_success": success}

    # Two methods make it resettable, and the distance gives planners the goal.
    def get_env_state(self) -> np.ndarray:
        return self._state.copy()

    def set_env_state(self, state: np.ndarray) -> None:
        self._state = np.array(state)

    def goal_distance(self, states: np.ndarray) -> np.ndarray:
        return np.linalg.norm(states[:, :2] - GOAL, axis=1)


gymnasium.register("Puck-v0", entry_point=f"{__name__}:Puck", max_episode_steps=200)


def main() -> None:
    print(pbcs_ompl.check_resettable(gymnasium.make("Puck-v0")))
    result = pbcs_ompl.plan("Puck-v0", planner="Ex", seed=0, max_transitions=50_000)
    print(f"solved: {result.solved}, {result.path_length} steps, {result.transitions:,} transitions, "
          f"replays exactly: {result.replay_ok}")


if __name__ == "__main__":
    main()
