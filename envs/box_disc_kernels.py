"""The steps of the box and the disc, compiled: arrays in, arrays out."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import STEP_SIGNATURE
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.envs.point_kernels import FIRST_FREE, WholeStep, displacement, outcome, whole_step

Step = tuple[float, float, bool]

# Places of their own settings in the array `settings`, after those of `point_kernels`.
EXTENT = FIRST_FREE
DISC_X, DISC_Y, DISC_RADIUS, PERTURBATION = range(FIRST_FREE, FIRST_FREE + 4)


@njit()
def _move_in_box(settings: Array, x: float, y: float, a: float, b: float) -> Step:
    x1, y1 = x + displacement(settings, a), y + displacement(settings, b)
    if x1 < 0.0 or x1 > settings[EXTENT] or y1 < 0.0 or y1 > settings[EXTENT]:
        return x, y, True
    return x1, y1, False


@njit()
def step_one_in_box(settings: Array, x: float, y: float, a: float, b: float) -> WholeStep:
    """Return all that a step of one point shows (see `whole_step`)."""
    x1, y1, hit = _move_in_box(settings, x, y, a, b)
    return whole_step(settings, x1, y1, hit)


@njit()
def move_in_box(settings: Array, states: Array, controls: Array) -> tuple[Array, BoolArray]:
    """Return the next states [B, 2] after controls [B, 2], and whether the border was hit [B]."""
    after = np.empty((states.shape[0], 2))
    hits = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        after[k, 0], after[k, 1], hits[k] = _move_in_box(
            settings, states[k, 0], states[k, 1], controls[k, 0], controls[k, 1])
    return after, hits


@njit(STEP_SIGNATURE)
def compiled_step_in_box(settings: Array, table: Array, integers: IndexArray, states: Array, parent: int,
                         controls: Array, child: int) -> tuple[float, bool, bool]:
    """Write states[child] from states[parent] and controls[child]; return reward, terminated, success."""
    x, y, hit = _move_in_box(settings, states[parent, 0], states[parent, 1],
                             controls[child, 0], controls[child, 1])
    states[child, 0], states[child, 1] = x, y
    return outcome(settings, x, y, hit)


@njit()
def _inside(settings: Array, x: float, y: float) -> bool:
    dx, dy = x - settings[DISC_X], y - settings[DISC_Y]
    inside: bool = dx * dx + dy * dy <= settings[DISC_RADIUS] * settings[DISC_RADIUS]
    return inside


@njit()
def _mix(seed: np.uint64, value: float) -> np.uint64:
    """Return a 64-bit hash of `seed` and the bits of a float (the finaliser of splitmix64)."""
    z = (seed ^ np.float64(value).view(np.uint64)) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit()
def _signed_fraction(bits: np.uint64) -> float:
    """Map 64 random bits to [-1, 1)."""
    return float(bits >> np.uint64(11)) * 2.0**-52 - 1.0


@njit()
def _move_in_disc(settings: Array, x: float, y: float, a: float, b: float) -> Step:
    x1, y1 = x + displacement(settings, a), y + displacement(settings, b)
    if _inside(settings, x1, y1) or x1 != x1 or y1 != y1:
        return x1, y1, False
    bits = _mix(_mix(_mix(_mix(np.uint64(0), x), y), a), b)
    x1 = x + settings[PERTURBATION] * _signed_fraction(bits)
    y1 = y + settings[PERTURBATION] * _signed_fraction(_mix(bits, 1.0))
    if _inside(settings, x1, y1):
        return x1, y1, True
    return x, y, True


@njit()
def step_one_in_disc(settings: Array, x: float, y: float, a: float, b: float) -> WholeStep:
    """Return all that a step of one point shows (see `whole_step`)."""
    x1, y1, hit = _move_in_disc(settings, x, y, a, b)
    return whole_step(settings, x1, y1, hit)


@njit()
def move_in_disc(settings: Array, states: Array, controls: Array) -> tuple[Array, BoolArray]:
    """Return the next states [B, 2] after controls [B, 2], and whether the border was hit [B]."""
    after = np.empty((states.shape[0], 2))
    hits = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        after[k, 0], after[k, 1], hits[k] = _move_in_disc(
            settings, states[k, 0], states[k, 1], controls[k, 0], controls[k, 1])
    return after, hits


@njit(STEP_SIGNATURE)
def compiled_step_in_disc(settings: Array, table: Array, integers: IndexArray, states: Array, parent: int,
                          controls: Array, child: int) -> tuple[float, bool, bool]:
    """Write states[child] from states[parent] and controls[child]; return reward, terminated, success."""
    x, y, hit = _move_in_disc(settings, states[parent, 0], states[parent, 1],
                              controls[child, 0], controls[child, 1])
    states[child, 0], states[child, 1] = x, y
    return outcome(settings, x, y, hit)


@njit()
def in_disc(settings: Array, states: Array) -> BoolArray:
    """Return which states [B, 2] lie in the disc [B]."""
    inside = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        inside[k] = _inside(settings, states[k, 0], states[k, 1])
    return inside
