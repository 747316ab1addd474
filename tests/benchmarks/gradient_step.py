"""Time one gradient step of DDPG, TD3 and SAC, ours against stable-baselines3's, in one run.

    python tests/benchmarks/gradient_step.py [--update auto|eager|compiled|autograd] [--rounds 9]

Both update actor, critics and targets from a full replay buffer with the same networks, mini-batches of 100,
and learning rates; both train SAC's temperature. Ratios of medians are what counts; rounds alternate, so that both see
the same noise.
"""

import argparse
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import gymnasium
import numpy as np
import stable_baselines3
import torch
from stable_baselines3.common.logger import configure

from pbcs_ompl.agents import DDPG, SAC, TD3, StackedAgent
from pbcs_ompl.agents.update import Compile

OBSERVATIONS, ACTIONS, FILL, BATCH = 2, 2, 20_000, 100
COMPILE: dict[str, Compile] = {"auto": "auto", "eager": False, "compiled": True, "autograd": False}
BARS = {(64, 64): 6.0, (256, 256): 2.0, (400, 300): 2.0}
ALGORITHMS: dict[str, type[StackedAgent]] = {"DDPG": DDPG, "TD3": TD3, "SAC": SAC}


class Plane(gymnasium.Env[np.ndarray, np.ndarray]):
    """Nothing but the spaces: the environment is never stepped."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (OBSERVATIONS,), np.float32)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)

    def reset(self, **_: Any) -> tuple[np.ndarray, dict[str, Any]]:
        return np.zeros(OBSERVATIONS, np.float32), {}


def transitions(count: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(0)
    observations, following = rng.uniform(-1, 1, (2, count, OBSERVATIONS))
    return (observations, rng.uniform(-1, 1, (count, ACTIONS)), rng.uniform(-1, 0, count), following,
            rng.random(count) < 0.05)


def ours(name: str, hidden: tuple[int, ...], seeds: int, update: str) -> Callable[[int], object]:
    kind = ALGORITHMS[name]
    if update == "autograd":
        kind = type(name, (kind,), {"gradients": {}})
    agent = kind(OBSERVATIONS, [-1.0] * ACTIONS, [1.0] * ACTIONS, settings=kind.settings_type(hidden=hidden),
                 seeds=range(seeds), compile=COMPILE[update])
    agent.add_transitions(*(np.stack([field] * seeds) for field in transitions(FILL)))
    return agent.train


def theirs(name: str, hidden: tuple[int, ...]) -> Callable[[int], object]:
    kind = getattr(stable_baselines3, name)
    model = kind("MlpPolicy", Plane(), policy_kwargs={"net_arch": list(hidden)}, batch_size=BATCH,
                 gamma=0.9, learning_rate=1e-3, tau=0.005, buffer_size=FILL, device="cpu", seed=0)
    model.set_logger(configure(format_strings=[]))
    for observation, action, reward, following, terminal in zip(*transitions(FILL), strict=True):
        model.replay_buffer.add(observation, following, action, reward, terminal, [{}])
    return lambda count: model.train(count, BATCH)


def microseconds(rows: list[tuple[Callable[[int], object], int, int]], rounds: int) -> list[float]:
    """Return the median times of one update of each (train, updates a round, threads), after a warm-up."""
    times: list[list[float]] = [[] for _ in rows]
    for _ in range(rounds + 1):
        for (train, count, threads), into in zip(rows, times, strict=True):
            torch.set_num_threads(threads)
            start = time.perf_counter()
            train(count)
            into.append((time.perf_counter() - start) / count * 1e6)
    return [median(row[1:]) for row in times]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", choices=COMPILE, default="auto",
                        help="how our update runs; autograd: without hand-written gradients")
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    for hidden, bar in BARS.items():
        count = 200 if max(hidden) <= 64 else 40
        rows = [(ours("DDPG", hidden, 1, options.update), count, 1), (theirs("DDPG", hidden), count, 1)]
        mine, other = microseconds(rows, options.rounds)
        print(f"DDPG, {hidden}, one thread: {mine:.0f} us, stable-baselines3 {other:.0f} us: "
              f"{other / mine:.1f} times faster (bar {bar:g})", flush=True)
    for name in ALGORITHMS:
        rows = [(ours(name, (64, 64), 1, options.update), 40, 1),
                (ours(name, (64, 64), 32, options.update), 20, 2), (theirs(name, (64, 64)), 40, 1)]
        mine, stack, other = microseconds(rows, options.rounds)
        print(f"{name}, (64, 64): stable-baselines3, one thread, {other:.0f} us; one seed, one thread {mine:.0f} us: "
              f"{other / mine:.1f} times faster; 32 seeds, two threads, {stack / 32:.0f} us a seed: "
              f"{other / stack * 32:.1f} times faster (target 8)", flush=True)


if __name__ == "__main__":
    main()
