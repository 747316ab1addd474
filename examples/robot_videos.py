"""How do I film a robot that executes its plan while some of its actions are random?

    python examples/robot_videos.py car|quadrotor|ant [FILE]

The car has one policy that was trained along its plan, the quadrotor model-predictive control, which reads the
simulator's state, the ant the follower that comes with the package.
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np
from PIL import Image

import pbcs_ompl
from pbcs_ompl.skills import RobotFollower
from pbcs_ompl.skills.baselines import MPPIController
from pbcs_ompl.skills.robots.evaluation import shortest_line

EVERY, PIXELS, COLOURS = 3, 240, 32
ROBOTS = {"car": ("pbcs/CarPark-v0", {}, 0.1), "quadrotor": ("pbcs/PlanarQuadrotor-v0", {}, 0.05),
          "ant": ("pbcs/AntMaze-v0", {"size": 2, "threads": 1}, 0.1)}
"""Id, options, and the fraction of random actions: with a tenth the quadrotor crashes more often than not."""


def controller_of(name, model, env):
    """Return what drives the environment, and the seed of its reset."""
    if name == "ant":
        follower = RobotFollower.shipped("ant")
        return follower.controller(shortest_line(follower, model)), 0
    plan = pbcs_ompl.plan(model, "Rides", seed=800).trajectory
    if name == "quadrotor":
        return MPPIController(model, plan, env.unwrapped.get_env_state), plan.reset_seed
    chain = pbcs_ompl.train(model, trajectory=plan, method="follow", seed=800, max_transitions=300_000).chain
    return chain.controller(), plan.reset_seed


def main(name: str = "car", file: str | None = None) -> None:
    env_id, options, noise = ROBOTS[name]
    model, rng = pbcs_ompl.make(env_id, options), np.random.default_rng(0)
    env = gymnasium.make(env_id, render_mode="rgb_array", **options)
    controller, seed = controller_of(name, model, env)
    controller.reset()
    observation, info = env.reset(seed=seed)
    env.action_space.seed(0)
    frames, over, steps = [picture(env)], False, 0
    while not over and steps < model.max_episode_steps:
        action = env.action_space.sample() if rng.random() < noise else controller.act(observation)
        observation, _, terminated, truncated, info = env.step(action)
        over, steps = terminated or truncated, steps + 1
        if steps % EVERY == 0 or over:
            frames.append(picture(env))
    target = Path(file or f"runs/{name}.gif")
    target.parent.mkdir(parents=True, exist_ok=True)
    frames += frames[-1:] * 10
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=80, loop=0, optimize=True)
    print(f"{name}: {'reached the goal' if info['is_success'] else 'failed'} after {steps} steps; {target}")


def picture(env) -> Image.Image:
    """Return a small picture of an environment."""
    return Image.fromarray(env.render()).resize((PIXELS, PIXELS)).quantize(COLOURS)


if __name__ == "__main__":
    main(*sys.argv[1:])
