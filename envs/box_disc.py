"""The box and the off-centre disc of [Matheron2020] 3.1, Figs 3.2-3.4: `pbcs/Box-v0` and `pbcs/Disc-v0`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs import box_disc_kernels as kernels
from pbcs_ompl.envs.point_env import CompiledStep, PointEnv
from pbcs_ompl.envs.point_kernels import WholeStep
from pbcs_ompl.envs.rendering import rasterise

EXTENT = 5.0


class BoxEnv(PointEnv):
    """S = [0, 5]^2; a step that would leave S does not move.

    Args:
        start: Start position, by default the centre.
        goal: Centre of a goal of radius 0.2, or None (default): nothing is rewarded and no episode ends.
        terminate_on_success, normalize_actions, render_mode: As in `PointEnv`.

    Raises:
        InvalidState: a start or goal outside of S.
    """

    where_invalid = "outside of the box"

    def __init__(self, *, start: Sequence[float] = (2.5, 2.5), goal: Sequence[float] | None = None,
                 terminate_on_success: bool = True, normalize_actions: bool = False,
                 render_mode: str | None = None):
        super().__init__(EXTENT, start, goal, terminate_on_success=terminate_on_success,
                         normalize_actions=normalize_actions, own_settings=(EXTENT,), render_mode=render_mode)

    def move(self, states: Array, controls: Array) -> tuple[Array, BoolArray]:
        """Return the next states [B, 2] and whether the border was hit [B]."""
        return kernels.move_in_box(self.settings, states, controls)

    def move_one(self, x: float, y: float, a: float, b: float) -> WholeStep:
        """Return what `move` does with one point, and what that shows."""
        return kernels.step_one_in_box(self.settings, x, y, a, b)

    def compiled_step(self) -> CompiledStep:
        """Return the step as a function for compiled planners."""
        return kernels.compiled_step_in_box, self.settings, np.zeros((1, 1)), np.zeros(1, dtype=np.int64)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, 2] lie in S [B]."""
        return self.in_bounds(states)


class DiscEnv(PointEnv):
    """The box of which only an off-centre disc can be reached; S stays what planners sample.

    A step that would leave the disc does not move, but for a small perturbation that makes repeated attempts
    visible as dense spots (footnote 2). Differs: the perturbation is a hash of (s, a) instead of a random
    number, so that the environment is deterministic and paths replay; and it never leads out of the disc.

    Args:
        centre: Centre of the disc; the figures of the thesis give no numbers.
        radius: Radius of the disc.
        perturbation: Each coordinate of a refused step changes by up to this much; 0 for none.
        start: Start position, by default the centre of the disc.
        goal: Centre of a goal of radius 0.2, or None (default): nothing is rewarded and no episode ends.
        terminate_on_success, normalize_actions, render_mode: As in `PointEnv`.

    Raises:
        InvalidOption: a disc that is not within the box, or a perturbation not in [0, 0.1].
        InvalidState: a start or goal outside of the disc.
    """

    where_invalid = "outside of the disc"

    def __init__(self, *, centre: Sequence[float] = (1.75, 1.75), radius: float = 1.25,
                 perturbation: float = 0.01, start: Sequence[float] | None = None,
                 goal: Sequence[float] | None = None,
                 terminate_on_success: bool = True, normalize_actions: bool = False,
                 render_mode: str | None = None):
        x, y = centre
        if not (radius > 0.0 and min(x, y) >= radius and max(x, y) <= EXTENT - radius):
            raise InvalidOption(f"centre={centre!r}, radius={radius!r}: the disc must lie within [0, 5]^2")
        if not 0.0 <= perturbation <= 0.1:
            raise InvalidOption(f"perturbation={perturbation!r}: expected a number from 0 to 0.1")
        self.disc = (float(x), float(y), float(radius))
        super().__init__(EXTENT, centre if start is None else start, goal,
                         terminate_on_success=terminate_on_success, normalize_actions=normalize_actions,
                         own_settings=(*self.disc, perturbation), render_mode=render_mode)

    def move(self, states: Array, controls: Array) -> tuple[Array, BoolArray]:
        """Return the next states [B, 2] and whether the border was hit [B]."""
        return kernels.move_in_disc(self.settings, states, controls)

    def move_one(self, x: float, y: float, a: float, b: float) -> WholeStep:
        """Return what `move` does with one point, and what that shows."""
        return kernels.step_one_in_disc(self.settings, x, y, a, b)

    def compiled_step(self) -> CompiledStep:
        """Return the step as a function for compiled planners."""
        return kernels.compiled_step_in_disc, self.settings, np.zeros((1, 1)), np.zeros(1, dtype=np.int64)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, 2] lie in the disc [B]."""
        return kernels.in_disc(self.settings, np.ascontiguousarray(states, dtype=np.float64))

    def render(self) -> Any:
        """Return the picture as an array [480, 480, 3] of uint8, for "rgb_array"."""
        if self.render_mode is None:
            return None
        return rasterise(EXTENT, self.walls, self.goal_circle, self.get_env_state(), ground=self.disc)
