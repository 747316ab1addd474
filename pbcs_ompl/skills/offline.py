"""The methods of chapter 4: an agent whose replay buffer begins with an exploration."""

import numpy as np

from pbcs_ompl.skills.exploration import explore
from pbcs_ompl.skills.one_skill import OneSkill


class Bootstrapped(OneSkill):
    """One policy from the environment's start; the replay buffer is filled with an exploration of Ex beforehand.

    The exploration counts as training transitions. Then the agent trains in sessions, as `Plain` does, and each is
    followed by a test from the start.

    Source: [Matheron2020] 4.4, "bootstrapped DDPG".
    """

    def _first_start(self) -> int:
        return 0

    @property
    def covered(self) -> float:
        """All or nothing."""
        return float(self.done)

    def step(self) -> None:
        """Explore first; from then on train for a session and test in turn."""
        state = self.state
        if not state.filled:
            self._fill()
            state.filled = True
        elif state.tested:
            state.tested = False
            state.solved = self.learner.test(0) == 1.0
        else:
            self._train()
            state.sessions += 1
            state.tested = True

    def _fill(self) -> None:
        """Fill the replay buffer with transitions of Ex, as far as the budget allows."""
        learner = self.learner
        count = min(self.settings.explored, learner.counter.left)
        found = explore(learner.model, count, int(learner.rng.integers(2**31)))
        learner.counter.count += len(found.rewards)
        before, after = (learner.frame(learner.model.observe(states)) for states in (found.states, found.next_states))
        learner.agent.add_transitions(before[None], found.controls[None], found.rewards[None], after[None],
                               found.terminals[None])

    def _train(self) -> None:
        self.learner.session_from(np.zeros(self.settings.beta, dtype=np.int64))


class Offline(Bootstrapped):
    """An agent that learns from an exploration of Ex alone; its own steps are only those of the tests.

    A session is as many updates as `beta` episodes of full length would bring.

    Source: [Matheron2020] 4.4, "offline DDPG".
    """

    def _train(self) -> None:
        settings = self.settings
        self.learner.agent.train(round(settings.beta * settings.max_steps * settings.updates_per_transition))
