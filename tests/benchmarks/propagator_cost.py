"""Cost of one propagation as OMPL sees it: `si.propagate` in a loop, on mazes. Budget: 5 us.

    python tests/benchmarks/propagator_cost.py

The loop and OMPL's call are included; `step_one` alone and an empty Python propagator are measured beside
it in the same run, so that the share of the bridge can be separated from that of the environment.
"""

import time
from collections.abc import Callable
from typing import Any

from ompl import control as oc

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.core.ompl_access import value_writer
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make

CALLS = 50_000
REPEATS = 5
BUDGET_MICROSECONDS = 5.0


def main() -> None:
    """Print the cost on three mazes, and what stock planners make of it."""
    for size in (3, 9, 15):
        model = make("pbcs/Maze-v0", {"size": size, "maze_seed": 1})
        start = model.initial_state(0).tolist()
        with make_problem(model, counter=Counter()) as problem:
            information = problem.space_information
            states, control = (information.allocState(), information.allocState()), information.allocControl()
            value_writer(information.getStateSpace())(states[0], start)
            control[0] = control[1] = 0.05
            bridge = microseconds(lambda: information.propagate(states[0], control, 1, states[1]))  # noqa: B023
            information.setStatePropagator(lambda *_: None)
            empty = microseconds(lambda: information.propagate(states[0], control, 1, states[1]))  # noqa: B023
        alone = microseconds(lambda: model.step_one(start, [0.05, 0.05]))  # noqa: B023
        verdict = "ok" if bridge <= BUDGET_MICROSECONDS else "TOO SLOW"
        print(f"maze {size:2}x{size:<2}  propagate {bridge:5.2f} us {verdict}  "
              f"(step_one {alone:.2f}, empty propagator {empty:.2f})")
    for planner in (oc.RRT, oc.EST, oc.KPIECE1):
        result = plan("pbcs/Maze-v0", planner, env_kwargs={"size": 9, "maze_seed": 1}, max_transitions=50_000)
        rate = result.transitions / result.seconds
        print(f"{result.planner:8} 9x9  {rate:9,.0f} propagations/s, solved {result.solved}")


def microseconds(call: Callable[[], Any]) -> float:
    """Return the least mean cost of a call over some repeats, the loop included."""
    best = float("inf")
    for _ in range(REPEATS):
        began = time.perf_counter()
        for _ in range(CALLS):
            call()
        best = min(best, time.perf_counter() - began)
    return 1e6 * best / CALLS


if __name__ == "__main__":
    main()
