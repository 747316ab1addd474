"""Does training continue in stable-baselines3? A trained chain as the actor of a TD3, its episodes as replay buffer."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import gymnasium
import numpy as np
import torch
from gymnasium.wrappers import TimeLimit
from stable_baselines3 import TD3
from stable_baselines3.common.logger import configure
from stable_baselines3.common.noise import NormalActionNoise

import pbcs_ompl
import pbcs_ompl.envs  # registers pbcs/Maze-v0

MAZE = {"size": 2}


def success_rate(model: TD3, env: gymnasium.Env, episodes: int = 10) -> float:
    """Return in how many episodes the goal is reached."""
    reached = 0
    for _ in range(episodes):
        observation, info = env.reset(seed=0)
        over = False
        while not over:
            observation, _, terminated, truncated, info = env.step(model.predict(observation, deterministic=True)[0])
            over = terminated or truncated or info["is_success"]
        reached += info["is_success"]
    return reached / episodes


def train_critics(model: TD3, steps: int) -> None:
    """Let the critics, which are new, learn what the actor is worth, while it stays as it is."""
    model.set_logger(configure(None, []))
    model.actor.requires_grad_(False)
    model.train(gradient_steps=steps, batch_size=256)
    model.actor.requires_grad_(True)


def main(steps: int = 300, critic_steps: int = 3000) -> int:
    """Train, distill, export, continue; return 0 when the policy reaches the goal before and after."""
    torch.set_num_threads(1)
    with TemporaryDirectory() as folder:
        chain = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, seed=0).chain
        pbcs_ompl.distill(chain, settings={"width": 64}, out=Path(folder) / "student")
        files = pbcs_ompl.export(Path(folder) / "student", "sb3", out=Path(folder) / "sb3", episodes=200,
                                  epsilon=0.3).files
        env = TimeLimit(gymnasium.make("pbcs/Maze-v0", **MAZE), 100)
        model = TD3.load(files[0], env=env)
        model.load_replay_buffer(files[1])
    before = success_rate(model, env)
    print(f"{model.replay_buffer.size()} transitions; success in stable-baselines3: {before:.0%}")
    train_critics(model, critic_steps)
    model.lr_schedule = lambda _: 1e-5  # with the default of 1e-3 a good actor is lost within 250 steps
    model.action_noise = NormalActionNoise(np.zeros(2), 0.2 * np.ones(2))
    model.learn(steps)
    after = success_rate(model, env)
    print(f"after {steps} more steps there: {after:.0%}")
    return 0 if before == after == 1.0 else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
