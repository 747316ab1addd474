"""Time one gradient step of DDPG, TD3 and SAC: our kernel, our torch path and stable-baselines3, in one run.

    python tests/benchmarks/gradient_step.py [--algorithms DDPG TD3 SAC DDPG+norm] [--rounds 7] [--observations 2]

All update actor, critics and targets from a full replay buffer with the same networks, mini-batches and learning rates,
on one thread; all train SAC's temperature. "torch" is our hand-written gradients, "autograd" our losses without them.
stable-baselines3 has no layer norm. Times are the thread's own, so that other work on the machine counts less; rounds
alternate, and ratios of medians are what counts. The last lines are of 32 seeds as one stack on two threads, by the
clock on the wall, for stable-baselines3 too.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

import gymnasium
import numpy as np
import stable_baselines3
import torch
from stable_baselines3.common.logger import configure

from pbcs_ompl.agents import DDPG, SAC, TD3, StackedAgent

ACTIONS, FILL = 2, 20_000
SIZES, BATCHES = ((64, 64), (128, 128), (256, 256)), (100, 256)
ALGORITHMS: dict[str, type[StackedAgent]] = {"DDPG": DDPG, "TD3": TD3, "SAC": SAC, "DDPG+norm": DDPG}
Train = Callable[[int], object]


class Plane(gymnasium.Env[np.ndarray, np.ndarray]):
    """Nothing but the spaces: the environment is never stepped."""

    def __init__(self, observations: int):
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (observations,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)

    def reset(self, **_: Any) -> tuple[np.ndarray, dict[str, Any]]:
        return np.zeros(self.observation_space.shape or (), np.float32), {}


def transitions(count: int, observations: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(0)
    before, after = rng.uniform(-1, 1, (2, count, observations))
    return before, rng.uniform(-1, 1, (count, ACTIONS)), rng.uniform(-1, 0, count), after, rng.random(count) < 0.05


def ours(name: str, hidden: tuple[int, ...], batch: int, observations: int, *, seeds: int = 1,
         way: str = "kernel") -> Train:
    kind = ALGORITHMS[name]
    if way == "autograd":
        kind = type(name, (kind,), {"gradients": {}})
    settings = kind.settings_type(hidden=hidden, batch_size=batch, layer_norm=name.endswith("+norm"))
    agent = kind(observations, [-1.0] * ACTIONS, [1.0] * ACTIONS, settings=settings, seeds=range(seeds),
                 compile="auto" if way == "kernel" else False)
    agent.add_transitions(*(np.stack([field] * seeds) for field in transitions(FILL, observations)))
    return agent.train


def theirs(name: str, hidden: tuple[int, ...], batch: int, observations: int) -> Train:
    kind = getattr(stable_baselines3, name)
    model = kind("MlpPolicy", Plane(observations), policy_kwargs={"net_arch": list(hidden)}, batch_size=batch,
                 gamma=0.9, learning_rate=1e-3, tau=0.005, buffer_size=FILL, device="cpu", seed=0)
    model.set_logger(configure(format_strings=[]))
    for observation, action, reward, following, terminal in zip(*transitions(FILL, observations), strict=True):
        model.replay_buffer.add(observation, following, action, reward, terminal, [{}])
    return lambda count: model.train(count, batch)


def microseconds(rows: Sequence[tuple[Train, int, int]], rounds: int, clock: Callable[[], float]) -> list[float]:
    """Return the median times of one update of each (train, updates a round, threads), after a warm-up."""
    times: list[list[float]] = [[] for _ in rows]
    for _ in range(rounds + 1):
        for (train, count, threads), into in zip(rows, times, strict=True):
            torch.set_num_threads(threads)
            start = clock()
            train(count)
            into.append((clock() - start) / count * 1e6)
    return [median(row[1:]) for row in times]


def on_one_thread(name: str, hidden: tuple[int, ...], batch: int, options: argparse.Namespace) -> None:
    count, slow = (40, 20) if max(hidden) <= 64 else (20, 5)
    ways = {way: (ours(name, hidden, batch, options.observations, way=way), count if way == "kernel" else slow, 1)
            for way in ("kernel", "torch", "autograd")}
    if hasattr(stable_baselines3, name):
        ways["stable-baselines3"] = (theirs(name, hidden, batch, options.observations), slow, 1)
    kernel, *others = microseconds(list(ways.values()), options.rounds, time.thread_time)
    compared = "; ".join(f"{way} {us:.0f}: {us / kernel:.1f} times"
                         for way, us in zip(list(ways)[1:], others, strict=True))
    print(f"{name}, {hidden}, batch {batch}: kernel {kernel:.0f} us; {compared}", flush=True)


def as_one_stack(name: str, options: argparse.Namespace) -> None:
    rows = [(ours(name, (64, 64), 100, options.observations, seeds=32), 20, 2),
            (theirs(name, (64, 64), 100, options.observations), 40, 1)]
    stack, other = microseconds(rows, options.rounds, time.perf_counter)
    print(f"{name}, (64, 64), batch 100, 32 seeds on two threads: {stack / 32:.0f} us a seed, stable-baselines3 on one "
          f"{other:.0f}: {other / stack * 32:.1f} times", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--algorithms", nargs="+", choices=ALGORITHMS, default=list(ALGORITHMS))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--observations", type=int, default=2, help="numbers of an observation")
    options = parser.parse_args()
    for name in options.algorithms:
        for hidden in SIZES:
            for batch in BATCHES:
                on_one_thread(name, hidden, batch, options)
    for name in options.algorithms:
        if hasattr(stable_baselines3, name):
            as_one_stack(name, options)


if __name__ == "__main__":
    main()
