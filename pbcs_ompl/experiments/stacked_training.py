"""Many seeds of one agent in one environment, as one stack: what the studies of chapters 4 and 6 run."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.agents.noise import Noise, draw_all
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.experiments.training_curves import Curves

NEVER = -1
Observer = Callable[[StackedAgent], Array]
"""A number for each seed [S]."""


@dataclass(frozen=True)
class LoopSettings:
    """Settings of a stacked training.

    Attributes:
        steps: Environment steps of each seed, in each of its copies of the environment.
        copies: Copies of the environment for each seed, side by side.
        episode_steps: Longest episode.
        block: Steps between two trainings; each makes the updates of all of them. With the length of an episode, a seed
            that has not found the reward trains after each episode, as in [Matheron2020] 6.2.2.
        updates_per_transition: Gradient steps for each environment step.
        evaluate_every: Steps between two evaluations, a multiple of `block`.
        patience: A seed that has passed this many evaluations in a row leaves the stack; 0 for never. The others train
            as they would have in the full stack.
        expert_after: Steps after which the `expert` acts, if there is one ([Matheron2020] Fig. 6.2b).

    Raises:
        InvalidOption: a value out of its range.
    """

    steps: int
    copies: int = 1
    episode_steps: int = 50
    block: int = 50
    updates_per_transition: float = 1.0
    evaluate_every: int = 1000
    patience: int = 0
    expert_after: int = 0

    def __post_init__(self) -> None:
        for name in ("steps", "copies", "episode_steps", "block"):
            if getattr(self, name) < 1:
                raise InvalidOption(f"{name} is {getattr(self, name)}, expected at least 1")
        if self.steps % self.block or self.evaluate_every % self.block or self.evaluate_every < 1:
            raise InvalidOption(f"steps={self.steps} and evaluate_every={self.evaluate_every}, expected multiples of "
                                f"block={self.block}")
        if self.updates_per_transition < 0 or self.patience < 0 or self.expert_after < 0:
            raise InvalidOption("updates_per_transition, patience and expert_after must not be negative")


class StackedTraining:
    """Collect, train, evaluate, for all seeds of `agent` together.

    Each seed has a random stream of its own: a stack of S seeds does what S stacks of one do. `agent` is the stack of
    the `active` seeds, those that have not left.

    Args:
        model: The environment.
        agent: A stack of S agents.
        noise: How they explore; the actions are those of `agent.explore` before.
        expert: Actions [B, A] for states [B, D] that are tried instead after `expert_after` steps.
        observers: Numbers to record at each evaluation, by name.

    Source: [Matheron2020] 6.2.2. Differs: training comes after blocks of steps instead of after episodes, since seeds
    whose episodes differ in length train together; the policy is the same for all steps of a block.
    """

    def __init__(self, model: ResettableModel, agent: StackedAgent, noise: Noise, settings: LoopSettings, *,
                 expert: Callable[[Array], Array] | None = None, observers: Mapping[str, Observer] | None = None):
        self.model, self.agent, self.noise, self.settings = model, agent, noise, settings
        self.expert, self.observers = expert, dict(observers or {})
        self.active: IndexArray = np.arange(len(agent.seeds))
        self._starts = np.array([model.initial_state(seed) for seed in agent.seeds])
        self._generators = [SeedTree(seed).child("behaviour").generator() for seed in agent.seeds]
        self._states = np.repeat(self._starts[:, None], settings.copies, axis=1)
        self._ages = np.zeros((len(agent.seeds), settings.copies), dtype=np.int64)
        self._rewards = np.zeros(len(agent.seeds))
        self._passed = np.zeros(len(agent.seeds), dtype=np.int64)
        self._updates_due = 0.0
        never = np.full(len(agent.seeds), NEVER)
        self.curves = Curves(agent.seeds, first_reward=never, solved_at=never.copy(),
                             observed={name: [] for name in self.observers})

    def run(self) -> Curves:
        """Train to the end and return what happened."""
        with one_thread():
            self._run()
        return self.curves

    def _run(self) -> None:
        settings = self.settings
        self._evaluate()
        while self.curves.ended < settings.steps and len(self.active):
            self._collect()
            self._updates_due += settings.block * settings.copies * settings.updates_per_transition
            whole = int(self._updates_due)
            self._updates_due -= whole
            if whole:
                self.agent.train(whole)
            if self.curves.ended % settings.evaluate_every == 0:
                self._evaluate()
                self._drop_solved_seeds()

    def _collect(self) -> None:
        """Make a block of steps and store them."""
        settings, model = self.settings, self.model
        shape = (settings.block, settings.copies)
        generators = [self._generators[index] for index in self.active]
        draws = draw_all(self.noise, generators, shape, len(model.action_low))
        parts = [self._step(draws[:, step]) for step in range(settings.block)]
        self.agent.add_transitions(*(np.concatenate(part, axis=1) for part in zip(*parts, strict=True)))

    def _step(self, draws: Array) -> tuple[NDArray[Any], ...]:
        """Make one step; return observations, actions, rewards, next observations and terminals [S, B, ...]."""
        before = self._flat(self._states[self.active])
        observations = self._stacked(self.model.observe(before))
        if self.expert is not None and self.curves.ended >= self.settings.expert_after:
            actions = self._stacked(self.expert(before))
        else:
            actions = self.noise.apply(self.agent.explore(observations), draws, self._ages[self.active] == 0,
                                       self.model.action_low, self.model.action_high)
        outcome = self.model.transition(before, self._flat(actions))
        following = self._stacked(self.model.observe(outcome.states))
        rewards, terminals = self._stacked(outcome.rewards)[..., 0], self._stacked(outcome.terminated)[..., 0]
        self.curves.ended += 1
        self._count_rewards(rewards > 0.0)
        ages = self._ages[self.active] + 1
        ended = terminals | (ages >= self.settings.episode_steps)
        self._ages[self.active] = np.where(ended, 0, ages)
        self._states[self.active] = np.where(ended[..., None], self._starts[self.active, None],
                                             self._stacked(outcome.states))
        return observations, actions, rewards, following, terminals

    def _count_rewards(self, rewarded: BoolArray) -> None:
        counts = rewarded.sum(axis=1)
        self._rewards[self.active] += counts
        first = self.active[(counts > 0) & (self.curves.first_reward[self.active] == NEVER)]
        self.curves.first_reward[first] = self.curves.ended

    def _evaluate(self) -> None:
        curves, active = self.curves, self.active
        success = solved(self.model, self.agent, self._starts[active], self.settings.episode_steps)
        self._passed[active] = np.where(success, self._passed[active] + 1, 0)
        curves.steps.append(curves.ended)
        self._add_row(curves.success, success)
        self._add_row(curves.rewarded, self._rewards[active] / max(1, curves.ended * self.settings.copies))
        for name, observer in self.observers.items():
            self._add_row(curves.observed[name], observer(self.agent))

    def _add_row(self, rows: list[NDArray[Any]], values: NDArray[Any]) -> None:
        """Append a row for all seeds: `values` of the active ones, of the others what there was before."""
        row = rows[-1].copy() if rows else np.empty(len(self.curves.seeds), dtype=values.dtype)
        row[self.active] = values
        rows.append(row)

    def _drop_solved_seeds(self) -> None:
        """Let seeds that have passed `patience` evaluations in a row leave."""
        stays = self._passed[self.active] < self.settings.patience
        if self.settings.patience == 0 or stays.all():
            return
        self.curves.solved_at[self.active[~stays]] = self.curves.ended
        self.active = self.active[stays]
        if len(self.active):
            kept = np.flatnonzero(stays).tolist()
            self.agent = self.agent.clone(kept)
            self.noise.keep(kept)

    def _flat(self, values: Array) -> Array:
        return values.reshape(-1, values.shape[-1])

    def _stacked(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(len(self.active), self.settings.copies, -1)


def solved(model: ResettableModel, agent: StackedAgent, starts: Array, max_steps: int) -> BoolArray:
    """Return whether each agent, without noise, comes from its start [S, D] to the goal within `max_steps` [S]."""
    states = starts.copy()
    success = np.zeros(len(starts), dtype=np.bool_)
    running = np.ones(len(starts), dtype=np.bool_)
    for _ in range(max_steps):
        actions = agent.act(model.observe(states)[:, None])[:, 0]
        outcome = model.transition(states, actions)
        states = outcome.states
        success |= outcome.success & running
        running &= ~(outcome.success | outcome.ended)
        if not running.any():
            break
    return success


def chunks(seeds: int, size: int) -> Iterator[list[int]]:
    """Yield the seeds 0, 1, ... in stacks of at most `size`."""
    for first in range(0, seeds, size):
        yield list(range(first, min(first + size, seeds)))
