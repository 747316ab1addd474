"""What Ex costs on a MuJoCo robot: transitions/s against a Python loop, planner overhead, restores, bytes a node.

    python tests/benchmarks/ant_maze.py [transitions]

All figures are of one run, so that the load of the machine hits both sides of each ratio alike.
"""

import sys
import time
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.types import Array, Transition
from pbcs_ompl.planners import Ex, PlanningContext
from pbcs_ompl.resettable import make

SLICES = 4
"""The loop and the planner take turns this often."""


class Stopwatch:
    """Adds up the time spent in a model's transition, and counts the calls."""

    def __init__(self, model: Any):
        self.inside, self.calls, self.widest = 0.0, 0, 0
        self._transition = model.transition
        model.transition = self

    def __call__(self, states: Array, controls: Array) -> Transition:
        began = time.perf_counter()
        result = self._transition(states, controls)
        self.inside += time.perf_counter() - began
        self.calls += 1
        self.widest = max(self.widest, len(states))
        return result


def python_loop(steps: int, seed: int) -> float:
    """Return the seconds of random steps of the environment itself."""
    env = gymnasium.make("pbcs/AntMaze-v0").unwrapped
    env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    began = time.perf_counter()
    for step in range(steps):
        env.step(rng.uniform(-1.0, 1.0, 8))
        if step % 500 == 499:
            env.reset()
    return time.perf_counter() - began


def ex(steps: int, seed: int) -> tuple[float, Stopwatch, float, int]:
    """Return the seconds of Ex's search, the time inside transitions, bytes a node, and the transitions made."""
    strategies = []

    class Watched(Ex):
        def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
            strategies.append(self)
            super().start(context, rng)

    model: Any = make("pbcs/AntMaze-v0")
    model.transition(np.tile(model.initial_state(0), (4, 1)), np.zeros((4, 8)))  # wake the threads
    watch = Stopwatch(model)
    result = plan(model, Watched, seed=seed, max_transitions=steps)
    (strategy,) = strategies
    size = (result.tree.nbytes + strategy.nbytes) / len(result.tree)
    return result.seconds, watch, size, result.transitions


def restore_cost(rounds: int = 3000) -> tuple[float, float]:
    """Return the microseconds of a restore of Gymnasium's Ant, and of one of its steps."""
    model: Any = make("Ant-v5")
    env, state = model.env, model.initial_state(0)
    began = time.perf_counter()
    for _ in range(rounds):
        env.set_env_state(state)
    restore = (time.perf_counter() - began) / rounds
    action = np.zeros(8)
    began = time.perf_counter()
    for _ in range(rounds // 10):
        env.inner.step(action)
    return 1e6 * restore, 1e7 * (time.perf_counter() - began) / rounds


def main() -> None:
    """Measure and print."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 40_000
    plan("pbcs/AntMaze-v0", "Ex", max_transitions=64)  # compile
    loop = search = inside = 0.0
    calls = widest = made = 0
    size = 0.0
    for turn in range(SLICES):
        seconds, watch, size, transitions = ex(steps // SLICES, turn)
        loop += python_loop(transitions, turn)
        search, inside, made = search + seconds, inside + watch.inside, made + transitions
        calls, widest = calls + watch.calls, max(widest, watch.widest)
    restore, step = restore_cost()
    print(f"transitions/s     Ex {made / search:,.0f}, Python loop {made / loop:,.0f}: {loop / search:.2f} times")
    print(f"planner overhead  {1 - inside / search:.1%} of the time; batches of {made / calls:.1f}, at most {widest}")
    print(f"memory            {size:.0f} bytes a node")
    print(f"restore of Ant    {restore:.1f} us (a step: {step:.0f} us)")


if __name__ == "__main__":
    main()
