"""Plan once, then let one method execute the plan under random actions, in fresh environments."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.judge import Controller, Judge
from pbcs_ompl.skills import Evaluation, train
from pbcs_ompl.skills.baselines import (
    LQRController,
    MPPIController,
    OpenLoop,
    evaluate_privileged,
    train_reverse_curriculum,
)

PRIVILEGED = ("mppi",)
TIMED_STEPS = 200
"""Most actions over which the milliseconds of one are averaged."""
RULES = ("goal", "feature", "max_episode_steps")


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each method, seed and task: method by method, since the first ones are the cheapest."""
    common = {key: sweep[key] for key in ("noise", "planner", "plan_transitions")}
    return [{"name": f"{task}-{method}-{index}", "task": task, "method": method, "index": index,
             "seed": sweep["first_seed"] + index, **common,
             **{key: value for key, value in (options | budget).items() if key not in ("seeds", "without")}}
            for method, budget in sweep["methods"].items() for index in range(min(seeds, budget["seeds"]))
            for task, options in sweep["tasks"].items()
            if method not in options.get("without", ()) and index < options.get("seeds", seeds)]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Plan, prepare the method, and execute it at each level of noise."""
    seed, kwargs = settings["seed"], dict(settings.get("env_kwargs", {}))
    if "size" in kwargs:
        kwargs["maze_seed"] = seed
    model = make(settings["env"], kwargs, start_seed=seed, **{key: settings[key] for key in RULES if key in settings})
    found = plan(model, settings["planner"], seed=seed, max_transitions=settings["plan_transitions"])
    record = settings | {"env_kwargs": kwargs, "planned": found.solved, "plan_transitions": found.transitions,
                         "plan_steps": found.path_length, "privileged": settings["method"] in PRIVILEGED}
    if not found.solved or found.trajectory is None or not found.trajectory.length:
        return record | {"evaluations": None}
    task = _Task(model, found.trajectory, settings["episodes"], seed)
    began = time.process_time()
    if settings["method"] == "mppi":
        return record | {"train_transitions": 0, "cpu_seconds": 0.0, **task.predictive(settings["noise"])}
    controller, transitions = _controller(settings["method"], task, settings["max_transitions"] - found.transitions)
    spent = time.process_time() - began
    return record | {"train_transitions": transitions, "cpu_seconds": spent,
                     **task.driven(controller, settings["noise"])}


@dataclass(frozen=True)
class _Task:
    """A plan to be executed.

    Attributes:
        model: The environment.
        plan: In it.
        episodes: Executions at each level of noise.
        seed: Of the random actions.
    """

    model: ResettableModel
    plan: Trajectory
    episodes: int
    seed: int

    def driven(self, controller: Controller | None, noise: list[float]) -> dict[str, Any]:
        """Return the evaluations of a controller of observations, and the milliseconds of an action."""
        if controller is None:
            return {"evaluations": {str(epsilon): None for epsilon in noise}, "ms_per_action": None}
        judge, found = Judge.of(self.model), {}
        for epsilon in noise:
            executions = judge.drive(controller, reset_seeds=[self.plan.reset_seed] * self.episodes,
                                     max_steps=self.model.max_episode_steps, epsilon=epsilon, seed=self.seed)
            found[str(epsilon)] = Evaluation.of(executions, epsilon).summary()
        return {"evaluations": found, "ms_per_action": self._milliseconds(controller)}

    def _milliseconds(self, controller: Controller) -> float:
        """Return how long an action takes, of one episode."""
        observations = self.model.observe(self.plan.states[:TIMED_STEPS])
        controller.reset()
        controller.act(observations[0])
        controller.reset()
        began = time.process_time()
        for observation in observations:
            controller.act(observation)
        return 1e3 * (time.process_time() - began) / len(observations)

    def predictive(self, noise: list[float]) -> dict[str, Any]:
        """Return the evaluations of model-predictive control, which reads the simulator's state."""
        counter, found = Counter(), {}
        rng, timed = np.random.default_rng(self.seed), list[_Timed]()

        def timed_controller(read_state: Callable[[], Array]) -> Controller:
            timed.append(_Timed(MPPIController(self.model, self.plan, read_state, rng=rng, counter=counter)))
            return timed[-1]

        for epsilon in noise:
            found[str(epsilon)] = evaluate_privileged(
                timed_controller, self.model.spec, reset_seed=self.plan.reset_seed,
                max_steps=self.model.max_episode_steps, episodes=self.episodes, epsilon=epsilon,
                seed=self.seed).summary()
        spent, steps = sum(one.spent for one in timed), max(1, sum(one.steps for one in timed))
        return {"evaluations": found, "ms_per_action": 1e3 * spent / steps,
                "simulated_per_action": counter.count / steps}


class _Timed:
    """A controller, the seconds that its actions took, and their number."""

    def __init__(self, controller: Controller):
        self._controller, self.spent, self.steps = controller, 0.0, 0

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes."""
        self._controller.reset(count)

    def act(self, observation: Any) -> Any:
        """Return actions."""
        began = time.process_time()
        action = self._controller.act(observation)
        self.spent, self.steps = self.spent + time.process_time() - began, self.steps + 1
        return action


def _controller(method: str, task: _Task, budget: int) -> tuple[Controller | None, int | None]:
    """Return a method's controller, None where training gave none, and the transitions that it took, if known."""
    counter = Counter()
    if method == "open-loop":
        return OpenLoop(task.plan.actions), 0
    if method == "lqr":
        return LQRController.along(task.model, task.plan, rng=np.random.default_rng(task.seed), counter=counter), (
            counter.count)
    if method == "reverse-curriculum":
        trained = train_reverse_curriculum(task.model, task.plan, seed=task.seed, max_transitions=max(1, budget))
        return trained.chain(task.model.max_episode_steps).controller(), trained.trainer.counter.count
    try:
        result = train(task.model, trajectory=task.plan, method=method, seed=task.seed, max_transitions=max(1, budget))
    except InvalidState:  # one step leaves the balls of radius 0.1 in which skills of PBCS begin
        return None, None
    return None if result.chain is None else result.chain.controller(), result.train_transitions
