"""Finds by trying which numbers of MuJoCo an environment reads before they are written again."""

import numpy as np

from pbcs_ompl.resettable.actions import ActionMap, copied
from pbcs_ompl.resettable.adapters.mujoco_state import ModelParts, Physics, ReadFirst, derived_arrays, overwrite
from pbcs_ompl.resettable.memory.exploration import SEEDS, episodes
from pbcs_ompl.resettable.memory.memory import Memory
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.rules import SUCCESS
from pbcs_ompl.resettable.simulation import Simulation

PROBED = (0, 1, 12, 30)
"""Where in an episode it is tried: after the reset and after steps."""


def find_read_first(simulation: Simulation, physics: Physics, parts: ModelParts, memory: Memory) -> ReadFirst:
    """Return the numbers of `MjData` that steps or observations depend on beside the physics.

    Args:
        simulation: The environment's.
        physics, parts, memory: What is saved of it.
    """
    probe = _Probe(simulation, physics, parts, memory)
    found = ReadFirst(simulation.model, simulation.data, probe.depends_on)
    for count, _ in enumerate(episodes(simulation.env, SEEDS[:1], PROBED[-1])):
        if count in PROBED and probe.begin():
            found.look(simulation.data)
            probe.restore()
    return found


class _Probe:
    """Overwrites numbers in one state and compares what the environment reports."""

    def __init__(self, simulation: Simulation, physics: Physics, parts: ModelParts, memory: Memory):
        self._simulation = simulation
        self._physics, self._parts, self._memory = physics, parts, memory
        actions = ActionMap.of(simulation.env.action_space)
        self._action = actions.to_action(np.random.default_rng(1).uniform(actions.low, actions.high))

    def begin(self) -> bool:
        """Take the present state; return whether reports of it are the same twice."""
        model, data = self._simulation.model, self._simulation.data
        self._saved = self._physics.save(model, data), self._parts.save(model), self._memory.save()
        self._derived = derived_arrays(model, data)
        self._expected = self._report([], 1.0)
        same = self._expected == self._report([], 1.0)
        self.restore()
        return same

    def restore(self) -> None:
        """Go back to the state, numbers that are derived from it included."""
        self._put_back([], 1.0)

    def depends_on(self, rows: list[tuple[str, int]]) -> bool:
        """Return whether reports change with rows of derived numbers."""
        return any(self._report(rows, sign) != self._expected for sign in (1.0, -1.0))

    def _report(self, rows: list[tuple[str, int]], sign: float) -> list[bytes]:
        """Return what is observed and what a step reports, with the rows overwritten."""
        try:
            self._put_back(rows, sign)
            seen = flat(self._simulation.observed()).tobytes()
            self._put_back(rows, sign)
            observation, reward, terminated, truncated, info = self._simulation.env.step(copied(self._action))
        except Exception as error:  # an environment may refuse such numbers: then it reads them
            return [type(error).__name__.encode()]
        success = repr([info.get(key) for key in SUCCESS]).encode()
        return [seen, flat(observation).tobytes(), np.array([reward, terminated, truncated], float).tobytes(), success,
                self._physics.save(self._simulation.model, self._simulation.data).tobytes(),
                self._memory.save().tobytes()]

    def _put_back(self, rows: list[tuple[str, int]], sign: float) -> None:
        """Go back to the state, with rows of derived numbers overwritten that the environment does not refresh."""
        physics, parts, memory = self._saved
        model, data = self._simulation.model, self._simulation.data
        self._parts.load(model, parts)
        self._memory.load(memory)
        self._physics.load(model, data, physics)
        for name, values in self._derived.items():
            getattr(data, name)[:] = values
        overwrite(data, rows, sign)
        self._simulation.refresh()
