"""Is a training solved? Its chain is executed in fresh environments, and the criterion decides."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.verification import verify
from pbcs_ompl.core.errors import NotVerified
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.resettable.task import Task
from pbcs_ompl.skills.evaluation import Evaluation, execute_chain
from pbcs_ompl.skills.settings import CriterionSettings
from pbcs_ompl.skills.trained_controller import TrainedController


class Outcome(NamedTuple):
    """What a training came to: why it is not solved, what the judge found, and what the model says."""

    reason: str | None
    nominal: Evaluation | None = None
    robust: Evaluation | None = None
    model_success_rate: float | None = None
    transitions: int = 0
    """Steps of the judge's executions."""

    @property
    def is_believed(self) -> bool:
        """Whether the judge has executed the chain, and executions in the model do not contradict it."""
        robust, believed = self.robust, self.model_success_rate
        return robust is not None and believed is not None and (
            robust.wilson[1] >= wilson(round(believed * robust.episodes), robust.episodes)[0])  # both are samples


def judged(chain: TrainedController | None, trajectory: Trajectory | None, model: ResettableModel,
           criterion: CriterionSettings, seed: int) -> Outcome:
    """Execute a complete chain in fresh environments; without a chain, nothing has to be done in them.

    Args:
        chain: The result of the training.
        trajectory: The plan.
        model: The environment.
        criterion: What a solved training has to reach.
        seed: Of the executions.
    """
    task = Task(model.spec, model.make_env)
    if chain is None:
        done = trajectory is not None and not trajectory.length and verify(trajectory, model).solved
        return Outcome(None if done else "there is no skill")
    try:
        once = execute_chain(chain, task, episodes=1, epsilon=0.0, seed=seed)
        often = execute_chain(chain, task, episodes=criterion.robust_episodes, epsilon=criterion.robust_epsilon,
                              seed=seed)
    except NotVerified as error:
        return Outcome(str(error))
    starts = np.repeat(chain.start[None], criterion.robust_episodes, axis=0)
    believed = chain.rollouts(model, starts, epsilon=criterion.robust_epsilon,
                              rng=SeedTree(seed).child("model evaluation").generator())
    rate = float(believed.success.mean())
    outcome = Outcome(None, Evaluation.of(once, 0.0), Evaluation.of(often, criterion.robust_epsilon), rate,
                      sum(execution.steps for execution in (*once, *often)))
    return outcome._replace(reason=failure(outcome, criterion))


def failure(outcome: Outcome, criterion: CriterionSettings) -> str | None:
    """Return why a complete training does not meet the criterion of a solved one; None when it does."""
    nominal, robust, believed = outcome.nominal, outcome.robust, outcome.model_success_rate
    if nominal is None or robust is None or believed is None:
        return outcome.reason
    if nominal.success_rate == 1 and robust.success_rate >= criterion.robust_rate:
        return None
    if nominal.success_rate < 1:
        ending = next(iter(nominal.endings))
        found = f"the chain does not reach the goal without noise (the episode ended: {ending})"
    else:
        found = (f"{robust.successes} of {robust.episodes} executions with {robust.epsilon:.0%} random actions "
                 f"succeed, expected {criterion.robust_rate:.0%}")
    if not outcome.is_believed:
        cut = robust.endings.get("truncated", 0)
        mostly = cut > (robust.episodes - robust.successes) / 2
        why = (f"{cut} were cut by the environment's limit of steps: shorten the plan (pbcs plan --improve), or "
               "make the limit larger" if mostly else "so the model is not true to the environment: run pbcs doctor")
        found += f"; in the model that it was trained in {believed:.0%} succeed, {'but ' if mostly else ''}{why}"
    return found
