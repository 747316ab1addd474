"""The steps of the box and the disc, compiled: arrays in, arrays out.

`disc` is the array (x, y, radius, perturbation).
"""

import numpy as np
from numba import njit

from envs.point_kernels import displacement
from pbcs_ompl.core.contracts import Array, BoolArray

Point = tuple[float, float]
Step = tuple[float, float, bool]


@njit(cache=True)
def _move_in_box(settings: Array, extent: float, x: float, y: float, a: float, b: float) -> Step:
    x1, y1 = x + displacement(settings, a), y + displacement(settings, b)
    if x1 < 0.0 or x1 > extent or y1 < 0.0 or y1 > extent:
        return x, y, True
    return x1, y1, False


@njit(cache=True)
def step_one_in_box(settings: Array, extent: float, x: float, y: float, a: float, b: float) -> Point:
    """Return the next position of one point as a tuple of two floats."""
    x1, y1, _ = _move_in_box(settings, extent, x, y, a, b)
    return x1, y1


@njit(cache=True)
def move_in_box(settings: Array, extent: float, states: Array, controls: Array) -> tuple[Array, BoolArray]:
    """Return the next states [B, 2] after controls [B, 2], and whether the border was hit [B]."""
    after = np.empty((states.shape[0], 2))
    hits = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        after[k, 0], after[k, 1], hits[k] = _move_in_box(
            settings, extent, states[k, 0], states[k, 1], controls[k, 0], controls[k, 1])
    return after, hits


@njit(cache=True)
def _inside(disc: Array, x: float, y: float) -> bool:
    dx, dy = x - disc[0], y - disc[1]
    return dx * dx + dy * dy <= disc[2] * disc[2]


@njit(cache=True)
def _mix(seed: np.uint64, value: float) -> np.uint64:
    """Return a 64-bit hash of `seed` and the bits of a float (the finaliser of splitmix64)."""
    z = (seed ^ np.float64(value).view(np.uint64)) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True)
def _signed_fraction(bits: np.uint64) -> float:
    """Map 64 random bits to [-1, 1)."""
    return float(bits >> np.uint64(11)) * 2.0**-52 - 1.0


@njit(cache=True)
def _move_in_disc(settings: Array, disc: Array, x: float, y: float, a: float, b: float) -> Step:
    x1, y1 = x + displacement(settings, a), y + displacement(settings, b)
    if _inside(disc, x1, y1) or x1 != x1 or y1 != y1:
        return x1, y1, False
    bits = _mix(_mix(_mix(_mix(np.uint64(0), x), y), a), b)
    x1, y1 = x + disc[3] * _signed_fraction(bits), y + disc[3] * _signed_fraction(_mix(bits, 1.0))
    if _inside(disc, x1, y1):
        return x1, y1, True
    return x, y, True


@njit(cache=True)
def step_one_in_disc(settings: Array, disc: Array, x: float, y: float, a: float, b: float) -> Point:
    """Return the next position of one point as a tuple of two floats."""
    x1, y1, _ = _move_in_disc(settings, disc, x, y, a, b)
    return x1, y1


@njit(cache=True)
def move_in_disc(settings: Array, disc: Array, states: Array, controls: Array) -> tuple[Array, BoolArray]:
    """Return the next states [B, 2] after controls [B, 2], and whether the border was hit [B]."""
    after = np.empty((states.shape[0], 2))
    hits = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        after[k, 0], after[k, 1], hits[k] = _move_in_disc(
            settings, disc, states[k, 0], states[k, 1], controls[k, 0], controls[k, 1])
    return after, hits


@njit(cache=True)
def in_disc(disc: Array, states: Array) -> BoolArray:
    """Return which states [B, 2] lie in the disc [B]."""
    inside = np.empty(states.shape[0], dtype=np.bool_)
    for k in range(states.shape[0]):
        inside[k] = _inside(disc, states[k, 0], states[k, 1])
    return inside
