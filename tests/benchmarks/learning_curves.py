"""Learning curves on Pendulum-v1, ours against stable-baselines3's, with equal settings.

    python tests/benchmarks/learning_curves.py [DDPG TD3 SAC] [--seeds 5] [--steps 10000]

Both learn with (64, 64) networks, mini-batches of 100, learning rates of 1e-3, one update for each step after 1000
steps of random actions, and normal noise of a tenth of half the action box (SAC draws from its policy instead). Ours
learn as one stack. The final return is the mean of ten episodes without noise; intervals are Student's, over seeds.
"""

import argparse
import sys
import time
from typing import Any

import gymnasium
import numpy as np
import stable_baselines3
import torch
from scipy.stats import t
from stable_baselines3.common.callbacks import EventCallback
from stable_baselines3.common.noise import NormalActionNoise

from pbcs_ompl.agents import DDPG, SAC, TD3, Gaussian, StackedAgent

ALGORITHMS: dict[str, type[StackedAgent]] = {"DDPG": DDPG, "TD3": TD3, "SAC": SAC}
EPISODE, WARM_UP, DISCOUNT, SIGMA = 200, 1000, 0.98, 0.1
EVALUATIONS, EVALUATION_EPISODES = 5, 10


def pendulums(count: int, first_seed: int) -> tuple[list[Any], np.ndarray]:
    """Return environments and their first observations [count, 3]."""
    envs = [gymnasium.make("Pendulum-v1") for _ in range(count)]
    return envs, np.array([env.reset(seed=first_seed + index)[0] for index, env in enumerate(envs)])


def returns(act: Any, seeds: int) -> np.ndarray:
    """Return the mean returns [S] of policies `act` ([S, B, 3] to [S, B, 1]), from the same starts for all."""
    episodes = [pendulums(EVALUATION_EPISODES, 1000) for _ in range(seeds)]
    observations, total = np.array([first for _, first in episodes]), np.zeros(seeds)
    for _ in range(EPISODE):
        actions = act(observations)
        for seed, (envs, _) in enumerate(episodes):
            for index, env in enumerate(envs):
                observations[seed, index], reward, *_ = env.step(actions[seed, index].astype(np.float32))
                total[seed] += reward / EVALUATION_EPISODES
    return total


def ours(name: str, seeds: int, steps: int) -> np.ndarray:
    """Return the returns [E, S] of one stack of agents at each evaluation."""
    kind = ALGORITHMS[name]
    extra = {"temperature": 1.0} if name == "SAC" else {}
    settings = kind.settings_type(discount=DISCOUNT, **extra)
    agent = kind(3, [-2.0], [2.0], settings=settings, seeds=range(seeds))
    noise = Gaussian(0.0 if name == "SAC" else SIGMA)
    low, high, fresh = agent.action_low, agent.action_high, np.zeros((seeds, 1), dtype=bool)
    rng, curve = np.random.default_rng(0), []
    envs, observations = pendulums(seeds, 0)
    for step in range(1, steps + 1):
        actions = agent.explore(observations[:, None]) if step > WARM_UP else rng.uniform(low, high, (seeds, 1, 1))
        actions = noise.apply(actions, noise.draw(rng, (seeds, 1), 1), fresh, low, high)
        outcomes = [env.step(action[0].astype(np.float32)) for env, action in zip(envs, actions, strict=True)]
        following, rewards = np.array([outcome[0] for outcome in outcomes]), np.array([[o[1]] for o in outcomes])
        agent.add_transitions(observations[:, None], actions, rewards, following[:, None], fresh)
        observations = following if step % EPISODE else np.array([env.reset()[0] for env in envs])
        if step > WARM_UP:
            agent.train(1)
        if step % (steps // EVALUATIONS) == 0:
            curve.append(returns(agent.act, seeds))
    return np.array(curve)


class Curve(EventCallback):
    """Evaluates a model of stable-baselines3 now and then."""

    def __init__(self, every: int):
        super().__init__()
        self.every, self.returns = every, []

    def _on_step(self) -> bool:
        if self.num_timesteps % self.every == 0:
            self.returns.append(returns(lambda observations: self.model.predict(
                observations[0].astype(np.float32), deterministic=True)[0][None], 1)[0])
        return True


def theirs(name: str, seed: int, steps: int) -> np.ndarray:
    """Return the returns [E] of one agent of stable-baselines3."""
    noise = {} if name == "SAC" else {"action_noise": NormalActionNoise(np.zeros(1), np.full(1, SIGMA))}
    model = getattr(stable_baselines3, name)(
        "MlpPolicy", gymnasium.make("Pendulum-v1"), learning_rate=1e-3, batch_size=100, gamma=DISCOUNT, tau=0.005,
        learning_starts=WARM_UP, train_freq=1, gradient_steps=1, policy_kwargs={"net_arch": [64, 64]}, seed=seed,
        device="cpu", **noise)
    curve = Curve(steps // EVALUATIONS)
    model.learn(steps, callback=curve)
    return np.array(curve.returns)


def interval(values: np.ndarray) -> tuple[float, float]:
    """Return the 95 % interval of the mean."""
    reach = t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / len(values) ** 0.5
    return values.mean() - reach, values.mean() + reach


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("algorithms", nargs="*", choices=[*ALGORITHMS, []], default=[], metavar="ALGORITHM")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=10_000)
    options = parser.parse_args()
    torch.set_num_threads(1)
    agree = True
    for name in options.algorithms or ALGORITHMS:
        began = time.perf_counter()
        curves = {"ours": ours(name, options.seeds, options.steps)}
        between = time.perf_counter()
        curves["stable-baselines3"] = np.array([theirs(name, seed, options.steps) for seed in range(options.seeds)]).T
        seconds = (between - began, time.perf_counter() - between)
        (low, high), (their_low, their_high) = (interval(curve[-1]) for curve in curves.values())
        within = low <= their_high and their_low <= high
        agree &= bool(within)
        for (who, curve), spent in zip(curves.items(), seconds, strict=True):
            means = " ".join(f"{value:6.0f}" for value in curve.mean(axis=1))
            bounds = " to ".join(f"{value:.0f}" for value in interval(curve[-1]))
            print(f"{name}, {who}: returns {means}; at the end {bounds}, {spent:.0f} s for {options.seeds} seeds")
        print(f"{name}: the intervals {'overlap' if within else 'DO NOT OVERLAP'}", flush=True)
    sys.exit(not agree)


if __name__ == "__main__":
    main()
