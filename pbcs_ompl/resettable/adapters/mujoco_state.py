"""The state of a MuJoCo simulation: physics, what changes in the model, and what is read before it is written.

MuJoCo computes positions of bodies, forces and the like from the physics when a step begins, so after a step they are
those of the step before. An environment that reads them then (the body's place before the step, for a speed) depends on
them: these are found by trying, and saved.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.core.types import Array, IndexArray

LARGE = 20_000
"""Numbers in an array of a model that is compared after resets only."""
MOST_CHANGED = 5000
"""Numbers of the model that a state may hold."""
OPTIONS = "opt."
PHYSICS = frozenset({"qpos", "qvel", "act", "ctrl", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat",
                     "userdata", "plugin_state", "qacc_warmstart", "history", "eq_active"})
"""Arrays of `MjData` that are part of mjSTATE_INTEGRATION."""
FAR = 1000.0


class Physics:
    """The integration state of MuJoCo: time, positions, speeds, controls, applied forces, warm start and so on."""

    def __init__(self, mujoco: Any, model: Any):
        self._mujoco = mujoco
        self._kinds = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        self.size = int(mujoco.mj_stateSize(model, self._kinds))

    def save(self, model: Any, data: Any) -> Array:
        """Return the state [P]; time and positions come first."""
        saved = np.empty(self.size)
        self._mujoco.mj_getState(model, data, saved, self._kinds)
        return saved

    def load(self, model: Any, data: Any, saved: Array) -> None:
        """Set the state [P]."""
        self._mujoco.mj_setState(model, data, saved, self._kinds)


class ModelParts:
    """The numbers of a model and its options that resets or steps change; `look` after each of them."""

    def __init__(self, model: Any):
        self._names = _array_names(model) + [OPTIONS + name for name in dir(model.opt) if not name.startswith("_")
                                             and isinstance(getattr(model.opt, name), np.ndarray | float | int)]
        self._large = {name for name in self._names if np.size(_get(model, name)) > LARGE}
        self._last = self._bytes(model, self._names)
        self._arrays = {name: np.array(_get(model, name)) for name in self._names}
        self._rows: dict[str, IndexArray] = {}
        self._places: list[_Place] = []
        self.size = 0

    def look(self, model: Any, *, after_reset: bool) -> None:
        """Find what has changed since the last time."""
        names = [name for name in self._names if after_reset or name not in self._large]
        for name, now in self._bytes(model, names).items():
            if now != self._last[name]:
                self._add(name, np.array(_get(model, name)))
                self._last[name] = now

    def save(self, model: Any) -> Array:
        """Return the numbers that change [N]."""
        saved = np.empty(self.size)
        for name, rows, shape, start, stop in self._places:
            saved[start:stop].reshape(shape)[...] = _rows(_get(model, name), rows)
        return saved

    def load(self, model: Any, saved: Array) -> None:
        """Set the numbers that change [N]."""
        for name, rows, shape, start, stop in self._places:
            _set(model, name, rows, saved[start:stop].reshape(shape))

    def clear(self, model: Any) -> None:
        """Set the numbers that change to what they were at first."""
        for name, rows in self._rows.items():
            _set(model, name, rows, np.asarray(_rows(self._arrays[name], rows)))

    def values(self, model: Any) -> dict[str, Any]:
        """Return the numbers that change, by name."""
        return {f"model.{name}": _rows(_get(model, name), rows) for name, rows in self._rows.items()}

    def check(self, model: Any, owner: str) -> None:
        """Refuse an environment whose model has changed elsewhere than before.

        Args:
            model: The model.
            owner: The environment's name.

        Raises:
            NotResettable: says where.
        """
        for name in self._names:
            if name in self._large or _get(model, name) is None:
                continue
            now, before = np.array(_get(model, name)), self._arrays[name].copy()
            if name in self._rows and now.ndim:
                before[self._rows[name]] = now[self._rows[name]]
            if (name not in self._rows and now.tobytes() != before.tobytes()) or (
                    name in self._rows and now.ndim and now.tobytes() != before.tobytes()):
                raise NotResettable(f"{owner} is not resettable: model.{name} has changed, which some "
                                    f"hundred steps have not shown; change it in every reset")

    def _add(self, name: str, now: Array) -> None:
        before = self._arrays[name]
        changed = np.ones(1, np.bool_) if not now.ndim else (now != before).reshape(len(now), -1).any(axis=1)
        rows = np.flatnonzero(changed)
        self._rows[name] = np.union1d(self._rows[name], rows) if name in self._rows else rows
        self._places = _places(self._arrays, self._rows)
        self.size = self._places[-1].stop
        if self.size > MOST_CHANGED:
            raise NotResettable(f"model.{name} changes, and with it a state has more than {MOST_CHANGED} numbers "
                                f"of the model; change less of it, or implement get_env_state and set_env_state")

    @staticmethod
    def _bytes(model: Any, names: list[str]) -> dict[str, bytes]:
        return {name: np.asarray(_get(model, name)).tobytes() for name in names}


class ReadFirst:
    """The numbers of `MjData` that the environment reads before MuJoCo writes them again.

    Args:
        model, data: The simulation.
        changes_outcome: Returns whether what the environment reports changes when rows of arrays are overwritten.
    """

    def __init__(self, model: Any, data: Any, changes_outcome: Callable[[list[tuple[str, int]]], bool]):
        self._try = changes_outcome
        self._rows: dict[str, IndexArray] = {}
        self._places: list[_Place] = []
        self._candidates = [(name, row) for name, values in derived_arrays(model, data).items()
                            for row in range(len(values))]
        self.size = 0

    def look(self, data: Any) -> None:
        """Find them in the present state, beside those that were found before."""
        for name, row in self._found([each for each in self._candidates if not self._has(*each)]):
            self._rows[name] = np.union1d(self._rows.get(name, np.empty(0, np.intp)), [row]).astype(np.intp)
        self._places = _places({name: getattr(data, name) for name in self._rows}, self._rows)
        self.size = self._places[-1].stop if self._places else 0

    def save(self, data: Any) -> Array:
        """Return the numbers [R]."""
        saved = np.empty(self.size)
        for name, rows, shape, start, stop in self._places:
            saved[start:stop].reshape(shape)[...] = getattr(data, name)[rows]
        return saved

    def load(self, data: Any, saved: Array) -> None:
        """Set the numbers [R]."""
        for name, rows, shape, start, stop in self._places:
            getattr(data, name)[rows] = saved[start:stop].reshape(shape)

    def values(self, data: Any) -> dict[str, Any]:
        """Return the numbers, by name."""
        return {f"data.{name}": getattr(data, name)[rows] for name, rows in self._rows.items()}

    def _has(self, name: str, row: int) -> bool:
        return name in self._rows and row in self._rows[name]

    def _found(self, rows: list[tuple[str, int]]) -> list[tuple[str, int]]:
        """Return those of `rows` that matter, by halving."""
        if not rows or not self._try(rows):
            return []
        if len(rows) == 1:
            return rows
        half = len(rows) // 2
        return self._found(rows[:half]) + self._found(rows[half:])


class _Place(NamedTuple):
    """Where rows of an array are in a vector."""

    name: str
    rows: Any
    shape: tuple[int, ...]
    start: int
    stop: int


def _places(arrays: Mapping[str, Array], chosen: Mapping[str, IndexArray]) -> list[_Place]:
    """Return where the chosen rows of arrays are in a vector; rows that follow each other as a slice, which is fast."""
    places: list[_Place] = []
    for name, rows in chosen.items():
        part, start = _rows(arrays[name], rows), places[-1].stop if places else 0
        in_a_row = len(rows) == rows[-1] - rows[0] + 1
        places.append(_Place(name, slice(int(rows[0]), int(rows[-1]) + 1) if in_a_row else rows, np.shape(part), start,
                             start + int(np.size(part))))
    return places


def overwrite(data: Any, rows: list[tuple[str, int]], sign: float) -> None:
    """Put far-off numbers into rows of arrays."""
    for name, row in rows:
        array = getattr(data, name)
        array[row] += sign * (FAR + np.arange(array[row].size, dtype=np.float64).reshape(array[row].shape))


def _array_names(owner: Any) -> list[str]:
    return [name for name in dir(owner) if not name.startswith("_") and _is_array(owner, name)]


def _is_array(owner: Any, name: str) -> bool:
    try:
        value = getattr(owner, name)
    except Exception:  # some attributes of MuJoCo's own classes cannot be read in every state
        return False
    return isinstance(value, np.ndarray) and value.ndim > 0 and value.size > 0 and value.dtype.kind in "biuf"


def derived_arrays(model: Any, data: Any) -> dict[str, Array]:
    """Return copies of the arrays that MuJoCo computes from the physics, but for those of constraints and contacts.

    The latter have another length in each state; in a new simulation they are empty.
    """
    new = type(data)(model)
    return {name: getattr(data, name).copy() for name in _array_names(new) if name not in PHYSICS and _is_derived(
        getattr(data, name), getattr(new, name))}


def _is_derived(array: Array, new: Array) -> bool:
    return bool(array.shape == new.shape and array.dtype.kind == "f" and array.flags.writeable)


def _get(model: Any, name: str) -> Any:
    return getattr(model.opt, name[len(OPTIONS):]) if name.startswith(OPTIONS) else getattr(model, name)


def _rows(value: Any, rows: IndexArray | slice) -> Any:
    return value[rows] if np.ndim(value) else value


def _set(model: Any, name: str, rows: IndexArray | slice, part: Array) -> None:
    value = _get(model, name)
    if np.ndim(value):
        value[rows] = part
    else:
        setattr(model.opt, name[len(OPTIONS):], type(value)(part[()]))
