"""A trained controller outside of the toolkit: this file needs NumPy, and nothing else.

`pbcs export DIR --to numpy` writes a copy of this file, and the controller as an npz of the same name beside it:

    from controller import load

    controller = load()
    controller.reset()
    observation, info = env.reset()
    observation, *rest = env.step(controller.act(observation))

Everything is computed for batches; one episode is a batch of one. The axes are B episodes, O entries of an observation,
A of an action, I of what a network sees, F of a place on a line.
"""

import json
import math
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Arrays = dict[str, NDArray[Any]]
Words = dict[str, Any]
Memory = dict[str, Indices]
FORMAT = 1
LAYER_NORM_EPSILON = 1e-5
KEEP_SIDE = math.cos(math.pi / 3)
"""A side leads as long as the cosine of the angle between the line and its heading is at least this."""
LARGEST = 10.0
"""Bound of the inputs of a robot's network."""


def load(path: str | Path | None = None) -> "Controller":
    """Return the controller in an npz file.

    Args:
        path: The file; None for the one beside this file that is called like it.

    Raises:
        ValueError: the file holds no controller, or one of another version.
    """
    path = Path(__file__).with_suffix(".npz") if path is None else Path(path)
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    words = json.loads(str(arrays.pop("words", "{}")))
    if words.get("format") != FORMAT:
        raise ValueError(f"{path} has the format {words.get('format')}; this file reads controllers of format {FORMAT}")
    return Controller(words, arrays)


def flat(observation: Any) -> Array:
    """Return an observation as one vector: entries of dictionaries follow each other in the order of their names."""
    if isinstance(observation, dict):
        return np.concatenate([flat(observation[name]) for name in sorted(observation)])
    if isinstance(observation, tuple):
        return np.concatenate([flat(part) for part in observation])
    return np.asarray(observation, dtype=np.float64).ravel()


def _rows(observations: Any) -> Array:
    """Return observations of several episodes as vectors [B, O]."""
    if isinstance(observations, dict):
        return np.concatenate([_rows(observations[name]) for name in sorted(observations)], axis=1)
    if isinstance(observations, tuple):
        return np.concatenate([_rows(part) for part in observations], axis=1)
    rows = np.asarray(observations, dtype=np.float64)
    return rows.reshape(len(rows), -1)


Step = tuple[Array, Indices, Indices | None]
"""What networks see [B, I], which of them acts [B], and the side of a robot that leads [B]."""


class _Kind(Protocol):
    def __init__(self, words: Words, arrays: Arrays): ...

    def step(self, observations: Array, memory: Memory) -> Step: ...


class Controller:
    """Drives one episode, or several side by side, by observations alone.

    Attributes:
        words: What the controller is: the task, the meaning of observations and actions, the limit of steps.
        memory: What it keeps between steps, by name; each an array [B].

    Args:
        words: See above.
        arrays: Its numbers.
    """

    def __init__(self, words: Words, arrays: Arrays):
        kinds: dict[str, type[_Kind]] = {"chain": _Chain, "follower": _Follower, "robot follower": _RobotFollower}
        self.words = words
        self._kind = kinds[words["kind"]](words, arrays)
        self._networks = _Networks(arrays, words["networks"])
        self._actions = _Actions(arrays, words["action"]["shape"])
        self.reset()

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes side by side; None for one, whose observations and actions are not batches."""
        self._single = count is None
        self.memory: Memory = {name: np.full(1 if count is None else count, first, np.int64)
                       for name, first in self.words["memory"].items()}

    def restart(self, episodes: Any) -> None:
        """Begin some of the episodes again, by their indices or a mask [B]; the others continue."""
        for name, first in self.words["memory"].items():
            self.memory[name][episodes] = first

    def follow(self, corners: Any) -> None:
        """Let a robot follow the line through some corners [N, 2] from now on, and begin again at its start.

        Raises:
            ValueError: this is no robot's follower, or the corners are no line in the plane.
        """
        if not isinstance(self._kind, _RobotFollower):
            raise ValueError("only a robot's follower drives along any line; this controller has a task of its own")
        self._kind.line = _line_through(np.asarray(corners, dtype=np.float64), self.words["spacing"])
        self.restart(slice(None))

    def act(self, observation: Any) -> NDArray[Any]:
        """Return the action for an observation as the environment returns it; actions [B, ...] for those of a batch.

        Raises:
            ValueError: the observation has another size, or there are more or fewer than episodes.
        """
        observations = flat(observation)[None] if self._single else _rows(observation)
        count = len(next(iter(self.memory.values())))
        expected = (count, len(self.words["observation"]))
        if observations.shape != expected:
            raise ValueError(f"observations of the shape {observations.shape}; expected {expected}: "
                             f"{', '.join(self.words['observation'])} for each of {count} episodes")
        inputs, chosen, side = self._kind.step(observations, self.memory)
        controls = self._networks.act(inputs, chosen)
        if side is not None and isinstance(self._kind, _RobotFollower):
            controls = self._kind.turned_back(controls, side)
        actions = self._actions.of(controls)
        return actions[0] if self._single else actions


class _Networks:
    """Networks of the same inputs: ReLU layers, a tanh, and an affine map onto the box of controls."""

    def __init__(self, arrays: Arrays, count: int):
        self._low, self._half = arrays["low"], 0.5 * (arrays["high"] - arrays["low"])
        self._high = arrays["high"]
        self._networks = []
        for index in range(count):
            depth = sum(name.startswith(f"network{index}.weight") for name in arrays)
            names = [[f"network{index}.{part}_{layer}" for part in ("weight", "bias", "gain", "shift")]
                     for layer in range(depth)]
            self._networks.append([[arrays[name] for name in layer if name in arrays] for layer in names])

    def act(self, inputs: Array, chosen: Indices) -> Array:
        """Return the controls [B, A] of the networks `chosen` [B] for inputs [B, I]."""
        values = inputs.astype(np.float32)
        if len(chosen) == 1:
            raw = self._raw(values, chosen[0])
        else:
            raw = np.empty((len(values), len(self._low)), np.float32)
            for index in np.unique(chosen):
                raw[chosen == index] = self._raw(values[chosen == index], index)
        controls = (np.tanh(raw).astype(np.float64) + 1.0) * self._half + self._low
        return np.minimum(np.maximum(controls, self._low, out=controls), self._high, out=controls)

    def _raw(self, values: NDArray[np.float32], index: int) -> NDArray[np.float32]:
        *hidden, (weight, bias) = self._networks[index]
        for layer in hidden:
            values = values @ layer[0]
            values += layer[1]
            if len(layer) == 4:
                values -= values.mean(axis=1, keepdims=True)
                values /= np.sqrt(np.square(values).mean(axis=1, keepdims=True) + LAYER_NORM_EPSILON)
                values = values * layer[2] + layer[3]
            np.maximum(values, 0.0, out=values)
        return values @ weight + bias


class _Actions:
    """From controls, points of a box, to actions of the environment."""

    def __init__(self, arrays: Arrays, shape: list[int]):
        self._first, self._last, self._shape = arrays["first_action"], arrays["last_action"], tuple(shape)

    def of(self, controls: Array) -> NDArray[Any]:
        """Return the actions [B, *shape] for controls [B, A]; integers are rounded."""
        first, last = self._first, self._last
        if first.dtype.kind in "iub":
            controls = np.floor(controls + 0.5)
        actions = np.minimum(np.maximum(controls, first.astype(np.float64)), last.astype(np.float64))
        if first.dtype != np.float64:
            actions = np.minimum(np.maximum(actions.astype(first.dtype), first), last)
        return actions.reshape(len(actions), *self._shape)


class _Chain:
    """Switches to a later skill as soon as its entry is observed, and never goes back."""

    def __init__(self, words: Words, arrays: Arrays):
        self._origins, self._scales = arrays["origins"], arrays["scales"]
        self._centers, self._weights, self._squares = (arrays[f"ball.{part}"] for part in
                                                       ("centers", "weights", "squares"))
        self._owners = arrays["owners"]
        self._order = np.arange(len(self._origins))
        names = ("origin", "scale", "weights_1", "bias_1", "weights_2", "bias_2", "confidence")
        self._classifiers = [[arrays[f"classifier{index}.{name}"] for name in names]
                             for index in range(words["classifiers"])]

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what networks see [B, I], which one acts [B], and no side."""
        skill = memory["skill"]
        if len(self._owners):
            outside = (~self._parts(observations)).astype(np.float64) @ self._owners
            np.maximum(skill, np.where(outside == 0.0, self._order, 0).max(axis=1), out=skill)
        return (observations - self._origins[skill]) / self._scales[skill], skill, None

    def _parts(self, observations: Array) -> NDArray[np.bool_]:
        """Return which parts of entries [B, N] observations [B, O] lie in: balls, then classifiers."""
        squares = (observations[:, None] - self._centers) ** 2
        inside: NDArray[np.bool_] = (squares * self._weights).sum(axis=2) <= self._squares
        if not self._classifiers:
            return inside
        learnt = [_chance(observations, *numbers) >= confidence for *numbers, confidence in self._classifiers]
        return np.concatenate([inside, np.stack(learnt, axis=1)], axis=1)


def _chance(observations: Array, origin: Array, scale: Array, weights_1: Array, bias_1: Array, weights_2: Array,
            bias_2: Array) -> Array:
    """Return the output [B] of a classifier."""
    hidden = np.tanh((observations - origin) / scale @ weights_1 + bias_1)
    return 1.0 / (1.0 + np.exp(-(hidden @ weights_2 + bias_2)[:, 0]))


class _Follower:
    """Moves a pointer forward on a line, and sees where the line leads."""

    def __init__(self, words: Words, arrays: Arrays):
        self.line: Array = arrays.get("line", np.empty((0, 2)))
        self._distances, self._firsts = arrays["distances"], arrays["firsts"]
        self._entries, self._unit = arrays["entries"], arrays["unit"]
        self._origin, self._scale = arrays["origin"], arrays["scale"]
        self._patience = words["patience"]
        self._reach = np.arange(words["reach"] + 1)
        self._pass_radius = arrays.get("pass_radius", np.inf)  # of older files

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what networks see [B, I], which one acts [B], and no side."""
        places = observations[:, self._entries] / self._unit
        self._advance(places, memory)
        ahead = self._ahead(places, memory["pointer"])
        inputs = np.concatenate([(observations - self._origin) / self._scale, ahead.reshape(len(ahead), -1),
                                 self._stalled(memory)], axis=1)
        return inputs, np.searchsorted(self._firsts, memory["pointer"], side="right") - 1, None

    def _advance(self, places: Array, memory: Memory) -> None:
        """Move the pointers to the nearest points of those ahead, and count the steps since they moved last."""
        pointer, stalled = memory["pointer"], memory["stalled"]
        candidates = np.minimum(pointer[:, None] + self._reach, len(self.line) - 1)
        squares = ((self.line[candidates] - places[:, None]) ** 2).sum(axis=2)
        barred = (squares[:, 1:] > squares[:, :-1]) & (squares[:, 1:] > self._pass_radius ** 2)
        squares[:, 1:][np.logical_or.accumulate(barred, axis=1)] = np.inf
        moved = candidates[np.arange(len(places)), squares.argmin(axis=1)]
        stalled[:] = np.where(moved > pointer, 0, stalled + 1)
        pointer[:] = moved

    def _ahead(self, places: Array, pointer: Indices) -> Array:
        """Return the points of the line at the distances ahead, relative to where the episodes are [B, K, F]."""
        ahead: Array = self.line[np.minimum(pointer[:, None] + self._distances, len(self.line) - 1)] - places[:, None]
        return ahead

    def _stalled(self, memory: Memory) -> Array:
        share: Array = np.minimum(memory["stalled"] / self._patience, 1.0)
        return share[:, None]


class _RobotFollower(_Follower):
    """Sees body and line in the robot's own frame, from the side of the robot that leads; it drives along any line."""

    def __init__(self, words: Words, arrays: Arrays):
        super().__init__(words, arrays)
        self._sides, self._actions = arrays["side_observations"], arrays["side_actions"]
        self._frame = FreeJoint(words["speeds"]) if words["speeds"] else Fixed()
        self._half = arrays["half"]
        self._body = np.delete(np.arange(self._sides.shape[1]), self._entries)

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what the network sees [B, I], that it acts [B], and the side that leads [B].

        Raises:
            ValueError: there is no line yet.
        """
        if not len(self.line):
            raise ValueError("there is no line to drive along; call follow(corners) first")
        places = observations[:, self._entries]
        self._advance(places, memory)
        side = memory["side"]
        side[:] = self._leading(observations, places, memory["pointer"], side)
        seen = (self._sides[side] @ observations[:, :, None])[:, :, 0]
        c, s = self._frame.heading(seen)
        ahead = self._ahead(places, memory["pointer"])
        x, y = ahead[..., 0], ahead[..., 1]
        c, s = c[:, None], s[:, None]
        own = np.stack([c * x + s * y, c * y - s * x], axis=2).reshape(len(seen), -1)
        body = (self._frame.turned(seen, c[:, 0], -s[:, 0])[:, self._body] - self._origin) / self._scale
        inputs = np.concatenate([body, own, self._stalled(memory)], axis=1)
        return np.clip(inputs, -LARGEST, LARGEST), np.zeros(len(seen), np.int64), side

    def turned_back(self, controls: Array, side: Indices) -> Array:
        """Return the controls [B, A] of the robot for those of the side that leads."""
        return (controls[:, None] @ self._actions[side])[:, 0]

    def _leading(self, observations: Array, places: Array, pointer: Indices, before: Indices) -> Indices:
        """Return which side looks along the line [B]: the one that did as long as it does well enough."""
        if len(self._sides) == 1:
            return np.zeros(len(places), np.int64)
        last = len(self.line) - 1
        x, y = (self.line[np.minimum(pointer + self._half, last)] - places).T
        direction = _unit(x, y)
        cosines = []
        for one in self._sides:
            c, s = self._frame.heading(observations @ one.T)
            cosines.append(c * direction[0] + s * direction[1])
        along = np.stack(cosines)
        kept = along[np.maximum(before, 0), np.arange(len(places))] >= KEEP_SIDE
        return np.where(kept & (before >= 0), before, along.argmax(axis=0))


class Fixed:
    """The frame of a robot that has no heading."""

    def heading(self, seen: Array) -> tuple[Array, Array]:
        """Return cosine and sine [B] of the direction in which the robot looks: that of the x axis."""
        return np.ones(len(seen)), np.zeros(len(seen))

    def turned(self, seen: Array, c: Array, s: Array) -> Array:
        """Return what the robot observes of itself [B, O] in a turned world: the same."""
        return seen


class FreeJoint:
    """The frame of a robot whose observation begins with place and quaternion (w, x, y, z) of a free joint.

    Args:
        speeds: The entry where its speed begins.
    """

    def __init__(self, speeds: int):
        self._x, self._y = speeds, speeds + 1

    def heading(self, seen: Array) -> tuple[Array, Array]:
        """Return cosine and sine [B] of the direction in which the x axis of the joint points."""
        w, x, y, z = seen[:, 3:7].T
        return _unit(w * w + x * x - y * y - z * z, 2.0 * (w * z + x * y))

    def turned(self, seen: Array, c: Array, s: Array) -> Array:
        """Return observations [B, O] in a world turned by angles of cosine c and sine s [B]; the place is left out."""
        turned, x, y = seen.copy(), seen[:, self._x], seen[:, self._y]
        turned[:, self._x], turned[:, self._y] = c * x - s * y, s * x + c * y
        h, k = _half_angle(c, s)
        w, x, y, z = seen[:, 3:7].T
        quaternion = np.stack([h * w - k * z, h * x - k * y, h * y + k * x, h * z + k * w], axis=1)
        turned[:, 3:7] = quaternion * np.where(quaternion[:, :1] < 0, -1.0, 1.0)
        return turned


def _unit(x: Array, y: Array) -> tuple[Array, Array]:
    """Return cosine and sine of the directions of vectors; those of the x axis for a vector of no length."""
    length = np.hypot(x, y)
    none = length == 0.0
    length = np.where(none, 1.0, length)
    return np.where(none, 1.0, x / length), y / length


def _half_angle(c: Array, s: Array) -> tuple[Array, Array]:
    """Return cosine and sine of half of an angle, without loss of digits near 0 and near a half turn."""
    larger = np.sqrt((1.0 + np.abs(c)) / 2.0)
    smaller = np.abs(s) / (2.0 * larger)
    sign = np.where(s < 0, -1.0, 1.0)
    return np.where(c >= 0, larger, smaller), sign * np.where(c >= 0, smaller, larger)


def _line_through(corners: Array, spacing: float) -> Array:
    """Return the points [P, 2] of the line through corners [N, 2], about `spacing` apart along it."""
    if corners.ndim != 2 or corners.shape[1] != 2 or not len(corners) or not np.isfinite(corners).all():
        raise ValueError(f"corners of the shape {corners.shape}; expected finite ones [N, 2], N at least 1")
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    if lengths[-1] == 0.0:
        return corners[:1].copy()
    kept = np.concatenate([[True], np.diff(lengths) > 0])
    places = np.linspace(0.0, lengths[-1], max(1, round(float(lengths[-1]) / spacing)) + 1)
    return np.stack([np.interp(places, lengths[kept], column) for column in corners[kept].T], axis=1)
