"""One policy by a reverse curriculum along a plan, as in RFCL."""

from dataclasses import dataclass, field

import numpy as np

from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import BudgetUsedUp
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray
from pbcs_ompl.skills.config import TrainConfig
from pbcs_ompl.skills.episodes import run_episodes
from pbcs_ompl.skills.settings import PlannedSettings
from pbcs_ompl.skills.single_policy import SinglePolicy
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

AHEAD = np.array([0.5, 0.25, 0.125, 0.0625, 0.0625])
"""Probabilities that an episode begins 0 to 4 states ahead of the frontier (RFCL)."""


@dataclass(frozen=True)
class ReverseCurriculumSettings:
    """Settings of the reverse curriculum; those of RFCL, but for the time limit.

    Attributes:
        stride: States by which the frontier moves back.
        in_a_row: Successes in a row, from the frontier, after which it does.
        least_steps: Time limit of an episode that begins at the end of the plan.
        slack: An episode from the state t of a plan of T steps has `least_steps` + (T - t) / `slack` steps. RFCL has 3,
            for demonstrations that are slower than need be; but through a maze the shortest way is half of a plan.
        demonstrated: Transitions of the plan that are added with each of the agent's own: 1 is half and half.
        updates_per_transition: Gradient steps for each transition of the agent's own.
        agent_settings: Settings of SAC that differ from the preset "fast": ten critics, as in RLPD.
    """

    stride: int = 8
    in_a_row: int = 3
    least_steps: int = 16
    slack: float = 1.0
    demonstrated: float = 1.0
    updates_per_transition: float = 0.5
    agent_settings: dict[str, object] = field(default_factory=lambda: {"critics": 10, "layer_norm": True,
                                                                       "discount": 0.99})


class ReverseCurriculum(SinglePolicy):
    """The start moves back 8 states as soon as three episodes in a row succeed, until it is the plan's first.

    Half of what the agent learns from is the plan. The reward is 1 in the goal and 0 elsewhere. Once the frontier is
    the start, the policy is tested there and training continues until every test episode succeeds.

    Source: Tao et al. 2024, Reverse Forward Curriculum Learning, the reverse stage for one demonstration. Differs:
    networks of 64 units; a longer time limit (`slack`); the plan is mixed into one replay buffer; there is no forward
    stage, since there is one start.

    Args:
        trainer: What trains the agent.
        controls: Those of the plan [T, A].
        settings: Of the curriculum.
    """

    def __init__(self, trainer: SkillTrainer, controls: Array, settings: ReverseCurriculumSettings):
        super().__init__(trainer, max(0, trainer.waypoints.last - settings.stride))
        self.settings = settings
        states = trainer.waypoints.states
        outcome = trainer.model.transition(states[:-1], controls)
        self._plan = (states[:-1], controls, outcome.success.astype(np.float64), outcome.states,
                      outcome.success | outcome.terminated)
        self._row = 0

    def step(self) -> None:
        """Train on one batch of episodes; at the start, test."""
        state = self.state
        if state.tested:
            state.tested = False
            state.solved = self.trainer.test(0) == 1.0
            return
        succeeded, at_frontier = self._train()
        for success in succeeded[at_frontier]:
            self._row = self._row + 1 if success else 0
        if self._row >= self.settings.in_a_row:
            self._row = 0
            state.tested = state.start == 0
            state.start = max(0, state.start - self.settings.stride)

    def _train(self) -> tuple[BoolArray, BoolArray]:
        """Train on episodes from the frontier and just ahead; return which succeeded, and which began at it [B]."""
        trainer, settings, last = self.trainer, self.settings, self.trainer.waypoints.last
        count = trainer.settings.episodes_per_batch
        ahead = trainer.rng.choice(len(AHEAD), count, p=AHEAD)
        starts = trainer.waypoints.states[np.minimum(self.state.start + ahead, last - 1)]
        limit = settings.least_steps + int((last - self.state.start) / settings.slack)
        episodes = run_episodes(trainer.model, trainer.explore, trainer.target, starts, max_steps=limit,
                                epsilon=trainer.settings.epsilon, rng=trainer.rng, success_reward=None,
                                counter=trainer.counter)
        rewards = trainer.target.contains(trainer.model, episodes.next_states).astype(np.float64)
        trainer.add_transitions(episodes.states, episodes.controls, rewards, episodes.next_states, episodes.terminals)
        shown: IndexArray = trainer.rng.integers(0, last, round(settings.demonstrated * episodes.transitions))
        states, controls, goals, following, terminals = self._plan
        trainer.add_transitions(states[shown], controls[shown], goals[shown], following[shown], terminals[shown])
        trainer.train(episodes.transitions)
        at_frontier: BoolArray = ahead == 0
        return episodes.reached, at_frontier


def train_reverse_curriculum(model: ResettableModel, trajectory: Trajectory, *,
                             settings: ReverseCurriculumSettings | None = None, seed: int = 0,
                             max_transitions: int = 1_000_000) -> ReverseCurriculum:
    """Train one policy backwards along a plan, with SAC.

    Args:
        model: The environment.
        trajectory: The plan.
        settings: None for those of RFCL.
        seed: Root of all random streams.
        max_transitions: Budget of environment steps; `done` is False where it ends first.
    """
    settings, seeds = settings or ReverseCurriculumSettings(), SeedTree(seed)
    config = TrainConfig.resolve(
        method="pb", planner=None, planner_kwargs=None, agent="sac", preset="fast", seed=seed, device="cpu",
        settings={"updates_per_transition": settings.updates_per_transition, "episodes_per_batch": 8, "epsilon": 0.0,
                  "test_epsilon": 0.0, "remove_loops": False,
                  "max_steps": settings.least_steps + int(trajectory.length / settings.slack)},
        agent_settings=settings.agent_settings, max_transitions=max_transitions, planned=True)
    planned: PlannedSettings = config.settings  # type: ignore[assignment]
    waypoints = Waypoints(trajectory.states, model, planned.starts, trajectory.reset_seed, planned.plan)
    with one_thread():
        trainer = SkillTrainer(config.agent_factory(model), waypoints, planned.episodes, Counter(max_transitions),
                               seeds.child("skills").generator())
        method = ReverseCurriculum(trainer, trajectory.controls, settings)
        try:
            while not method.done:
                method.step()
        except BudgetUsedUp:
            return method
    return method
