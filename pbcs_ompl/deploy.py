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
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Complex = NDArray[np.complex128]
Arrays = dict[str, NDArray[Any]]
Words = dict[str, Any]
Memory = dict[str, Indices]
Step = tuple[Array, Indices]  # what networks see [B, I], and which of them acts [B]
FORMAT = 1
LAYER_NORM_EPSILON = 1e-5
KEEP_SIDE = math.cos(math.pi / 3)  # a side leads while the cosine of the angle of line and heading is at least this
QUATERNION = np.array([3, 6, 4, 5])  # where an observation with a free joint has the w, z, x and y of the quaternion
LEAN = np.array([0.5, -1.5, -1.5, 0.5])  # times a squared quaternion: below 0 from 60 degrees on
LARGEST = 10.0  # bound of the inputs of a robot's network


def load(path: str | Path | None = None) -> "Controller":
    """Return the controller in an npz file; None for the one beside this file that is called like it.

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


def _rows(observations: Any, single: bool) -> Array:
    """Return observations of several episodes, or of one, as vectors [B, O]; dictionaries in the order of names."""
    if isinstance(observations, dict):
        observations = tuple(observations[name] for name in sorted(observations))
    if isinstance(observations, tuple):
        return np.concatenate([_rows(part, single) for part in observations], axis=1)
    rows = np.asarray(observations, dtype=np.float64)
    return rows.reshape(1 if single else len(rows), -1)


class Controller:
    """Drives one episode, or several side by side, by observations alone.

    Attributes:
        words: What the controller is: the task, the meaning of observations and actions, the limit of steps.
        memory: What it keeps between steps, by name; each an array [B].
    """

    def __init__(self, words: Words, arrays: Arrays):
        kinds: dict[str, Any] = {"chain": _Chain, "follower": _Follower, "robot follower": _RobotFollower}
        self.words = words
        self._kind: _Chain | _Follower = kinds[words["kind"]](words, arrays)
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
        """Let a robot follow the line through some corners [N, F] from now on, and begin again at its start.

        They are (x, y), or (x, y, turning heading) where that counts; such headings count on after whole turns.

        Raises:
            ValueError: this is no robot's follower, or the corners are no such line.
        """
        if not isinstance(self._kind, _RobotFollower):
            raise ValueError("only a robot's follower drives along any line; this controller has a task of its own")
        size = self._kind.line.shape[1]
        self._kind.line = _line_through(np.asarray(corners, dtype=np.float64), size, self.words["spacing"])
        self.restart(slice(None))

    def act(self, observation: Any) -> NDArray[Any]:
        """Return the action for an observation as the environment returns it; actions [B, ...] for those of a batch.

        Raises:
            ValueError: the observation has another size, or there are more or fewer than episodes.
        """
        observations = _rows(observation, self._single)
        expected = (len(next(iter(self.memory.values()))), len(self.words["observation"]))
        if observations.shape != expected:
            raise ValueError(f"observations of the shape {observations.shape}; expected {expected}: "
                             f"{', '.join(self.words['observation'])}")
        controls = self._networks.act(*self._kind.step(observations, self.memory))
        if isinstance(self._kind, _RobotFollower):
            controls = self._kind.controls(controls, observations, self.memory)
        actions = self._actions.of(controls)
        return actions[0] if self._single else actions


class _Networks:
    """Networks of the same inputs: ReLU layers, a tanh, and an affine map onto the box of controls."""

    def __init__(self, arrays: Arrays, count: int):
        self._low, self._high, self._half = arrays["low"], arrays["high"], 0.5 * (arrays["high"] - arrays["low"])
        self._networks = []
        for index in range(count):
            depth = sum(name.startswith(f"network{index}.weight") for name in arrays)
            names = [[f"network{index}.{part}_{layer}" for part in ("weight", "bias", "gain", "shift")]
                     for layer in range(depth)]
            self._networks.append([_layer([arrays[name] for name in layer if name in arrays]) for layer in names])

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
            if len(layer) == 5:
                values /= np.sqrt(np.add.reduce(values * values, axis=1, keepdims=True) + layer[4])
                values *= layer[2]
                values += layer[3]
            np.maximum(values, 0.0, out=values)
        return np.asarray(values @ weight + bias)


def _layer(parts: list[NDArray[Any]]) -> list[NDArray[Any]]:
    """Return a layer whose outputs, where they are normalised, are centred by weights and bias; gain times root n."""
    if len(parts) == 2:
        return parts
    weight, bias, gain, shift = (part.astype(np.float64) for part in parts)
    exact = [weight - weight.mean(axis=1, keepdims=True), bias - bias.mean(), gain * math.sqrt(len(bias)), shift,
             np.array(len(bias) * LAYER_NORM_EPSILON)]
    return [part.astype(np.float32) for part in exact]


class _Actions:
    """From controls, points of a box, to actions of the environment."""

    def __init__(self, arrays: Arrays, shape: list[int]):
        self._first, self._last, self._shape = arrays["first_action"], arrays["last_action"], tuple(shape)
        self._low, self._high = self._first.astype(np.float64), self._last.astype(np.float64)

    def of(self, controls: Array) -> NDArray[Any]:
        """Return the actions [B, *shape] for controls [B, A]; integers are rounded."""
        if self._first.dtype.kind in "iub":
            controls = np.floor(controls + 0.5)
        actions = np.minimum(np.maximum(controls, self._low), self._high)
        if self._first.dtype != np.float64:
            actions = np.minimum(np.maximum(actions.astype(self._first.dtype), self._first), self._last)
        return actions.reshape(len(actions), *self._shape)


class _Chain:
    """Switches to a later skill as soon as its entry is observed, and never goes back."""

    def __init__(self, words: Words, arrays: Arrays):
        self._origins, self._scales = arrays["origins"], arrays["scales"]
        self._centers, self._weights, self._squares = (arrays[f"ball.{x}"] for x in ("centers", "weights", "squares"))
        self._owners, self._order = arrays["owners"], np.arange(len(self._origins))
        names = ("origin", "scale", "weights_1", "bias_1", "weights_2", "bias_2", "confidence")
        self._classifiers = [[arrays[f"classifier{k}.{name}"] for name in names] for k in range(words["classifiers"])]

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what networks see [B, I], and which one acts [B]."""
        skill = memory["skill"]
        if len(self._owners):
            outside = (~self._parts(observations)).astype(np.float64) @ self._owners
            np.maximum(skill, np.maximum.reduce(np.where(outside == 0.0, self._order, 0), axis=1), out=skill)
        return (observations - self._origins[skill]) / self._scales[skill], skill

    def _parts(self, observations: Array) -> NDArray[np.bool_]:
        """Return which parts of entries [B, N] observations [B, O] lie in: balls, then classifiers."""
        squares = (observations[:, None] - self._centers) ** 2
        inside: NDArray[np.bool_] = np.add.reduce(squares * self._weights, axis=2) <= self._squares
        for origin, scale, weights_1, bias_1, weights_2, bias_2, confidence in self._classifiers:
            hidden = np.tanh((observations - origin) / scale @ weights_1 + bias_1)
            chance = 1.0 / (1.0 + np.exp(-(hidden @ weights_2 + bias_2)))
            inside = np.concatenate([inside, chance >= confidence], axis=1)
        return inside


class _Follower:
    """Moves a pointer forward on a line, and sees where the line leads."""

    def __init__(self, words: Words, arrays: Arrays):
        self.line: Array = arrays.get("line", np.empty((0, len(arrays["unit"]))))
        self._distances, self._firsts, self._entries = arrays["distances"], arrays["firsts"], arrays["entries"]
        self._unit, self._origin, self._scale = arrays["unit"], arrays["origin"], arrays["scale"]
        self._patience, self._lost_after = words["patience"], words.get("lost_after") or np.inf
        self._reach, self._pass_square = np.arange(words["reach"] + 1), arrays.get("pass_radius", np.inf) ** 2
        sines, self._periods = arrays.get("sines", np.full(len(self._unit), -1)), arrays.get("periods")
        self._angles, self._sines, self._own = np.flatnonzero(sines >= 0), sines[sines >= 0], self._unit * (sines < 0)

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what networks see [B, I], and which one acts [B]."""
        places = observations[:, self._entries]
        if len(self._angles):
            places[:, self._angles] = np.arctan2(observations[:, self._sines], places[:, self._angles])
        places /= self._unit
        near = self._advance(places, memory)
        if self._periods is not None:
            observations = observations.copy()
            observations[:, self._entries] += (near - places) * self._own
        ahead = self._ahead(near, memory["pointer"], self._distances)
        inputs = np.concatenate([(observations - self._origin) / self._scale, ahead.reshape(len(ahead), -1),
                                 np.minimum(memory["stalled"][:, None] / self._patience, 1.0)], axis=1)
        return inputs, np.searchsorted(self._firsts, memory["pointer"], side="right") - 1

    def _near(self, places: Array, pointer: Indices) -> Array:
        """Return places [B, F] moved by whole periods to where they are nearest to the points of the pointers."""
        if self._periods is None:
            return places
        turns = np.rint((places - self.line[pointer]) / np.where(self._periods > 0.0, self._periods, np.inf))
        return np.asarray(places - self._periods * turns)

    def _advance(self, places: Array, memory: Memory) -> Array:
        """Move pointers to the nearest points ahead (of those passed, after a long wait); return what is near them."""
        pointer, stalled = memory["pointer"], memory["stalled"]
        lost = np.flatnonzero(stalled >= self._lost_after)
        if len(lost):
            squares = np.add.reduce(np.square(self.line - self._near(places, pointer)[lost, None]), axis=2)
            squares[np.arange(len(self.line)) > pointer[lost, None]] = np.inf
            pointer[lost], stalled[lost] = squares.argmin(axis=1), -1
        squares = np.add.reduce(np.square(self._ahead(self._near(places, pointer), pointer, self._reach)), axis=2)
        later = squares[:, 1:]
        barred = (later > squares[:, :-1]) & (later > self._pass_square)
        np.copyto(later, np.inf, where=np.logical_or.accumulate(barred, axis=1))
        moved = squares.argmin(axis=1)
        stalled += 1
        stalled[moved > 0] = 0
        np.minimum(pointer + moved, len(self.line) - 1, out=pointer)
        return self._near(places, pointer)

    def _ahead(self, places: Array, pointer: Indices, distances: Indices) -> Array:
        """Return the points of the line some distances [K] ahead, relative to where the episodes are [B, K, F]."""
        shown = self.line.take(np.minimum(pointer[:, None] + distances, len(self.line) - 1), axis=0)
        return np.asarray(shown - places[:, None])


class _RobotFollower(_Follower):
    """Sees body and line in the robot's own frame, from the side of the robot that leads; it drives along any line."""

    def __init__(self, words: Words, arrays: Arrays):
        super().__init__(words, arrays)
        sides, self._actions, self._waves = arrays["side_observations"], arrays["side_actions"], arrays["waves"]
        self._shape, self._all_sides = sides.shape[:2], np.concatenate(list(sides)).T.copy()
        self._distances = np.append(self._distances, arrays["half"])  # where the leading side looks
        self._frame = RobotFrame(words["speeds"], words.get("angle", -1))
        self._body = arrays.get("body", np.delete(np.arange(self._shape[1]), self._entries[:2]))
        self._burst = words.get("burst", 0)  # steps for which a car that is stuck swings

    def step(self, observations: Array, memory: Memory) -> Step:
        """Return what the network sees [B, I], and that it acts [B].

        Raises:
            ValueError: there is no line yet.
        """
        if not len(self.line):
            raise ValueError("there is no line to drive along; call follow(corners) first")
        places = observations.take(self._entries, axis=1) / self._unit
        side, rows = memory["side"], np.arange(len(observations))
        near = self._advance(places, memory)
        all_seen = (observations @ self._all_sides).reshape(len(rows), *self._shape)
        headings = self._frame.heading(all_seen)
        relative = self._ahead(near, memory["pointer"], self._distances)
        ahead = _complex(np.ascontiguousarray(relative[..., :2]))
        side[:] = self._leading(headings, ahead[:, -1], side)
        turn = headings[rows, side].conj()
        turned = (ahead[:, :-1, None] * turn[:, None, None]).view(np.float64)
        own = np.concatenate([turned, relative[:, :-1, 2:]], axis=2).reshape(len(rows), -1)
        body = (self._frame.turned(all_seen[rows, side], turn).take(self._body, axis=1) - self._origin) / self._scale
        inputs = np.concatenate([body, own, np.minimum(memory["stalled"][:, None] / self._patience, 1.0)], axis=1)
        return np.minimum(np.maximum(inputs, -LARGEST), LARGEST), np.zeros(len(rows), np.int64)

    def controls(self, controls: Array, observations: Array, memory: Memory) -> Array:
        """Return the controls [B, A] of the robot for those of the side that leads; fallen and stuck ones shake."""
        turned = (controls[:, None] @ self._actions[memory["side"]])[:, 0]
        swinging = self._frame.fallen(observations)
        if self._burst:
            over = memory["stalled"] - self._patience
            swinging |= (over >= 0) & (over // self._burst % 2 == 0)
        if swinging.any():
            turned[swinging] = self._waves[memory["stalled"][swinging] % len(self._waves)]
        return turned

    def _leading(self, headings: Complex, ahead: Complex, before: Indices) -> Indices:
        """Return which side looks along the line [B]: the one that did as long as it does well enough.

        Args:
            headings: Where the sides look [B, S].
            ahead: Where the line leads [B].
            before: The sides that led before [B], -1 for none.
        """
        if headings.shape[1] == 1:
            return np.zeros_like(before)
        along = (headings * _unit(ahead).conj()[:, None]).real
        kept = (along[np.arange(len(before)), before] >= KEEP_SIDE) & (before >= 0)
        return before if kept.all() else np.where(kept, before, along.argmax(axis=1))


class RobotFrame:
    """The frame of a robot: of a free joint, of a heading that is an entry of the observation, or of none.

    Vectors in the plane are complex. With a free joint observations begin with place and quaternion (w, x, y, z), which
    is two complex numbers, w + iz and x + iy: the sum of their squares points along the x axis of the joint, and a turn
    of the world by a multiplies both by exp(ia/2).

    Args:
        speeds: The entry where its speed begins; 0 for another robot.
        angle: Of another robot, the entry that is its heading; -1 for one without.
    """

    def __init__(self, speeds: int, angle: int = -1):
        self._heads, self._moved, self._angle = speeds > 0, np.array([speeds, speeds + 1, *QUATERNION]), angle

    def heading(self, seen: Array) -> Complex:
        """Return the directions [...] in which the x axis of the joint points in observations [..., O]."""
        if not self._heads:
            angles = seen[..., self._angle] if self._angle >= 0 else np.zeros(seen.shape[:-1])
            return np.asarray(np.exp(1j * angles))
        squares = np.square(_complex(seen.take(QUATERNION, axis=-1)))
        return _unit(squares[..., 0] + squares[..., 1])

    def fallen(self, seen: Array) -> NDArray[np.bool_]:
        """Return in which observations [B, O] the z axis of the joint leans by more than 60 degrees."""
        if not self._heads:
            return np.zeros(len(seen), np.bool_)
        return np.asarray(np.square(seen[:, 3:7]) @ LEAN < 0.0)

    def turned(self, seen: Array, turn: Complex) -> Array:
        """Return observations [B, O] in a world that is turned [B]; the place is left out."""
        if not self._heads:
            return seen
        moved = _complex(seen.take(self._moved, axis=1))
        moved[:, 0] *= turn
        quaternion = moved[:, 1:]
        quaternion *= np.sqrt(turn)[:, None]
        quaternion *= 1.0 - 2.0 * (quaternion[:, :1].real < 0)
        turned = seen.copy()
        turned[:, self._moved] = moved.view(np.float64)
        return turned


def _complex(vectors: Array) -> Complex:
    """Return pairs of numbers [..., 2 K] as complex ones [..., K]; [...] where K is 1."""
    numbers: Complex = vectors.view(np.complex128)
    return numbers[..., 0] if vectors.shape[-1] == 2 else numbers


def _unit(vectors: Complex) -> Complex:
    """Return vectors of length 1; those along the x axis for vectors of no length."""
    lengths = np.abs(vectors)
    none = lengths == 0.0
    return np.where(none, 1.0, vectors / np.where(none, 1.0, lengths)) if none.any() else vectors / lengths


def _line_through(corners: Array, size: int, spacing: float) -> Array:
    """Return the points [P, F] of the line through corners [N, F], F = size, about `spacing` apart along it."""
    if corners.ndim != 2 or corners.shape[1] != size or not len(corners) or not np.isfinite(corners).all():
        raise ValueError(f"corners of the shape {corners.shape}; expected finite ones [N, {size}], N at least 1")
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    if lengths[-1] == 0.0:
        return corners[:1].copy()
    kept = np.concatenate([[True], np.diff(lengths) > 0])
    places = np.linspace(0.0, lengths[-1], max(1, round(float(lengths[-1]) / spacing)) + 1)
    return np.stack([np.interp(places, lengths[kept], column) for column in corners[kept].T], axis=1)
