"""What a strategy may know of the problem."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray


@dataclass(frozen=True, eq=False)
class PlanningContext:
    """What a strategy may know of the problem.

    Attributes:
        feature_low, feature_high: Bounds of the explored feature [F]; infinite where there are none.
        bin_size: Suggested edge length of bins [F].
        action_low, action_high: Bounds of the controls [A].
        episode_steps: Suggested length of an episode.
        parallel_batch: How many nodes have to be expanded together to keep all cores busy; 1 where it does not matter.
        steer: Returns controls [B, A] that lead from states [B, D] towards features [B, F]; None where there is no
            steering.
        control_durations: The least and the most steps that a control lasts.
        periods: The period of each feature [F], 0 for one that has none; None where none has.
    """

    feature_low: Array
    feature_high: Array
    bin_size: Array
    action_low: Array
    action_high: Array
    episode_steps: int = 1000
    parallel_batch: int = 1
    steer: Callable[[Array, Array], Array] | None = None
    control_durations: tuple[int, int] = (1, 1)
    periods: Array | None = None

    def bins(self, name: str, given: Array | None) -> tuple[Array, IndexArray]:
        """Return an edge length of bins for each feature [F], and how many bins are in its period [F], 0 without one.

        The edge of a feature that has a period is the nearest one that divides it.

        Args:
            name, given: See `edge_lengths`.

        Raises:
            InvalidOption: `given` has another number of edges.
        """
        edges = self.edge_lengths(name, given)
        periods = np.zeros(len(edges)) if self.periods is None else self.periods
        turns = np.where(periods > 0.0, np.maximum(np.rint(periods / edges), 1.0), 0.0)
        edges = np.where(periods > 0.0, periods / np.maximum(turns, 1.0), edges)
        return edges, turns.astype(np.int64)

    def edge_lengths(self, name: str, given: Array | None) -> Array:
        """Return an edge length of bins for each feature [F].

        Args:
            name: The option that gives them.
            given: One for all or one for each feature; None for the suggested ones.

        Raises:
            InvalidOption: `given` has another number of edges.
        """
        features = len(self.bin_size)
        if given is None:
            return np.array(self.bin_size)
        if len(given) not in (1, features):
            raise InvalidOption(f"{name} has {len(given)} numbers; expected 1, or {features}")
        return np.array(np.broadcast_to(given, features))
