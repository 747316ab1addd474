"""What the deadlock study costs: time of a seed and step by size of stack, what leaving saves, memory of a seed.

    python tests/benchmarks/deadlock_stack.py [--seeds 25] [--steps 10000]

All on one core, in one run; ratios are what counts. `training loop / updates alone` says what the loop around the
gradient costs; `all stay / solved seeds leave` what it saves that a seed leaves once it is solved. Memory is counted
from the tensors, for seeds that stay to the end.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from pbcs_ompl.agents import DDPG, DDPGSettings, EpsilonGreedy
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.experiments.diagnostic_batch import Probe
from pbcs_ompl.experiments.stacked_training import LoopSettings, StackedTraining
from pbcs_ompl.resettable import make

MODEL = make("pbcs/Toy1D-v0")
SETTINGS = DDPGSettings(hidden=(64, 64), discount=0.99)
ROUNDS = 5
MANY = 10_000


def agent(seeds: int) -> DDPG:
    return DDPG(1, MODEL.action_low, MODEL.action_high, settings=SETTINGS, seeds=range(seeds))


def training(seeds: int, steps: int, patience: int = 0) -> StackedTraining:
    loop = LoopSettings(steps, evaluate_every=min(1000, steps), patience=patience)
    return StackedTraining(MODEL, agent(seeds), EpsilonGreedy(), loop, observers=Probe(MODEL).observers())


def updates_alone(seeds: int, steps: int) -> Callable[[], object]:
    filled = agent(seeds)
    rng, shape = np.random.default_rng(0), (seeds, 1000)
    filled.add_transitions(rng.random((*shape, 1)), rng.uniform(-0.1, 0.1, (*shape, 1)), rng.random(shape),
                    rng.random((*shape, 1)), rng.random(shape) < 0.1)

    def run() -> None:
        with one_thread():
            filled.train(steps)

    return run


def seconds(run: Callable[[], object]) -> float:
    """Processor time, so that other programs count for little."""
    began = time.process_time()
    run()
    return time.process_time() - began


def of_a_step(seeds: int, steps: int) -> dict[str, float]:
    """Microseconds for each seed and step, the least of some rounds."""
    kinds = {"updates alone": lambda: updates_alone(seeds, steps), "training loop": lambda: training(seeds, steps).run}
    times = {name: min(seconds(make_run()) for _ in range(ROUNDS)) for name, make_run in kinds.items()}
    return {name: 1e6 * value / seeds / steps for name, value in times.items()}


def bytes_of_a_seed(steps: int) -> dict[str, int]:
    """Count the tensors of a stack of two whose seeds have made N steps, for each seed."""
    stack = agent(2)
    vectors, numbers = np.zeros((2, steps, 1)), np.zeros((2, steps))
    stack.add_transitions(vectors, vectors, numbers, vectors, numbers)
    networks = sum(tensor.numel() * tensor.element_size() for network in (stack.actor, stack.critic)
                   for tensor in (*network.tensors().values(), network.gradient.flat))
    return {"networks, targets, gradients, Adam's moments": networks // 2,
            f"replay buffer after {steps:,} steps": stack.replay.state_dict()["rows"].nbytes // 2}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=25)
    parser.add_argument("--steps", type=int, default=10_000)
    arguments = parser.parse_args()
    of_a_step(2, 100)  # loads the kernels
    print("stack   updates alone   training loop   training loop / updates alone     [us for each seed and step]")
    for seeds in (1, 8, 25, 100):
        times = of_a_step(seeds, 500)
        ratio = times["training loop"] / times["updates alone"]
        print(f"{seeds:5d}   {times['updates alone']:13.0f}   {times['training loop']:13.0f}   {ratio:29.2f}")
    stay, leave = (seconds(training(arguments.seeds, arguments.steps, patience).run) for patience in (0, 3))
    print(f"{arguments.seeds} seeds, {arguments.steps:,} steps: all stay {stay:.1f} s, "
          f"solved seeds leave {leave:.1f} s, {stay / leave:.1f} times less")
    counts = bytes_of_a_seed(50_000)
    for name, count in counts.items():
        print(f"{name}: {count / 1e6:.2f} MB a seed, {count * MANY / 1e9:.1f} GB for {MANY:,}")


if __name__ == "__main__":
    main()
