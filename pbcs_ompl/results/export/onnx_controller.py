"""A whole controller as one ONNX graph: what it sees, which network acts, and the limits of actions.

What `pbcs_ompl.deploy` keeps between steps is an input and an output here: "skill" goes in, "next_skill" comes out. All
numbers but those of the networks are float64, so that a controller switches where it did before.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl import deploy
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.results.export.controller_data import ControllerData
from pbcs_ompl.results.export.onnx_graph import Graph
from pbcs_ompl.results.files import write_atomically

BATCH = "episodes"


def write_onnx(data: ControllerData, folder: Path) -> list[Path]:
    """Write controller.onnx into a folder, and return its path.

    Args:
        data: The controller.
        folder: Where.

    Raises:
        MissingDependency: onnx is not installed.
        InvalidOption: its networks have different shapes.
        RunFolderError: the file cannot be written.
    """
    content = onnx_model(data).SerializeToString()
    path = folder / "controller.onnx"
    write_atomically(path, lambda file: file.write(content))
    return [path]


def onnx_model(data: ControllerData) -> Any:
    """Return a controller as an `onnx.ModelProto`; see `write_onnx`.

    Its metadata are the words of the controller, each as JSON: among them "observation", the meaning of its entries,
    "action", and "memory", the values that the memory begins with.
    """
    words, arrays = data
    graph = Graph()
    size = len(words["observation"])
    seen = graph.input("observation", (BATCH, size), np.float64)
    memory = {name: graph.input(name, (BATCH,), np.int64) for name in words["memory"]}
    if words["kind"] == "robot follower":
        line = graph.input("line", ("points", len(arrays["entries"])), np.float64)
    else:
        line = graph.constant(arrays["line"]) if "line" in arrays else ""
    steps = {"chain": _chain, "follower": _follower, "robot follower": _robot}
    inputs, chosen, after = steps[words["kind"]](graph, data, seen, memory, line)
    controls = _networks(graph, data, inputs, chosen)
    if words["kind"] == "robot follower":
        turn = graph("Gather", arrays["side_actions"], after["side"], axis=0)
        controls = graph("Squeeze", graph("MatMul", graph("Unsqueeze", controls, [1]), turn), [1])
        controls = _shaken(graph, data, seen, controls, after["stalled"])
    shape = words["action"]["shape"]
    graph.output("action", _actions(graph, data, controls), (BATCH, *shape), arrays["first_action"].dtype)
    for name, value in after.items():
        graph.output(f"next_{name}", value, (BATCH,), np.int64)
    return graph.model({name: json.dumps(value) for name, value in words.items()})


def _networks(graph: Graph, data: ControllerData, inputs: str, chosen: str) -> str:
    """Return the controls [B, A] of the networks `chosen` [B]; the parameters of all are stacked."""
    arrays, count = data.arrays, data.words["networks"]
    depth = sum(name.startswith("network0.weight") for name in arrays)
    values = graph("Unsqueeze", graph.cast(inputs, np.float32), [1])
    for layer in range(depth):
        weight, bias, *norm = (_stacked(graph, arrays, count, f"{part}_{layer}", chosen)
                               for part in ("weight", "bias", "gain", "shift") if f"network0.{part}_{layer}" in arrays)
        values = graph("Add", graph("MatMul", values, weight), graph("Unsqueeze", bias, [1]))
        if norm:
            values = _normalised(graph, values, *(graph("Unsqueeze", part, [1]) for part in norm))
        if layer < depth - 1:
            values = graph("Relu", values)
    raw = graph.cast(graph("Squeeze", graph("Tanh", values), [1]), np.float64)
    half = 0.5 * (arrays["high"] - arrays["low"])
    controls = graph("Add", graph("Mul", graph("Add", raw, 1.0), half), arrays["low"])
    return graph("Min", graph("Max", controls, arrays["low"]), arrays["high"])


def _stacked(graph: Graph, arrays: dict[str, Any], count: int, name: str, chosen: str) -> str:
    """Return the parameters `name` of the networks `chosen` [B, ...]."""
    each = [arrays[f"network{index}.{name}"] for index in range(count)]
    if any(one.shape != each[0].shape for one in each):
        raise InvalidOption(f"networks of the shapes {sorted({one.shape for one in each})}; ONNX files hold policies "
                            "of one shape: use --to numpy")
    return graph("Gather", np.array(each), chosen, axis=0)


def _normalised(graph: Graph, values: str, gain: str, shift: str) -> str:
    centred = graph("Sub", values, graph("ReduceMean", values, [-1], keepdims=1))
    variance = graph("ReduceMean", graph("Mul", centred, centred), [-1], keepdims=1)
    deviation = graph("Sqrt", graph("Add", variance, np.float32(deploy.LAYER_NORM_EPSILON)))
    return graph("Add", graph("Mul", graph("Div", centred, deviation), gain), shift)


def _actions(graph: Graph, data: ControllerData, controls: str) -> str:
    """Return the actions [B, *shape] for controls [B, A]."""
    first, last = data.arrays["first_action"], data.arrays["last_action"]
    if first.dtype.kind in "iub":
        controls = graph("Floor", graph("Add", controls, 0.5))
    limited = graph("Min", graph("Max", controls, first.astype(np.float64)), last.astype(np.float64))
    actions = graph.cast(limited, first.dtype)
    if first.dtype == np.float32:  # rounding must not lead outside
        actions = graph("Min", graph("Max", actions, first), last)
    return graph("Reshape", actions, np.array([-1, *data.words["action"]["shape"]]))


Step = tuple[str, str, dict[str, str]]
"""What networks see, which of them acts, and the memory after the step."""


def _chain(graph: Graph, data: ControllerData, seen: str, memory: dict[str, str], line: str) -> Step:
    arrays, skill = data.arrays, memory["skill"]
    if len(arrays["owners"]):
        outside = graph("MatMul", graph.cast(graph("Not", _parts(graph, data, seen)), np.float64), arrays["owners"])
        inside = graph.cast(graph("Less", outside, 0.5), np.int64)
        order = np.arange(len(arrays["origins"]))
        skill = graph("Max", skill, graph("ReduceMax", graph("Mul", inside, order), [-1], keepdims=0))
    moved = graph("Sub", seen, graph("Gather", arrays["origins"], skill, axis=0))
    return graph("Div", moved, graph("Gather", arrays["scales"], skill, axis=0)), skill, {"skill": skill}


def _parts(graph: Graph, data: ControllerData, seen: str) -> str:
    """Return which parts of entries observations lie in [B, N]: balls, then classifiers."""
    words, arrays = data
    away = graph("Sub", graph("Unsqueeze", seen, [1]), arrays["ball.centers"][None])
    squares = graph("ReduceSum", graph("Mul", graph("Mul", away, away), arrays["ball.weights"][None]), [-1], keepdims=0)
    parts = [graph("LessOrEqual", squares, arrays["ball.squares"])] if len(arrays["ball.squares"]) else []
    for index in range(words["classifiers"]):
        own = {name: arrays[f"classifier{index}.{name}"] for name in
               ("origin", "scale", "weights_1", "bias_1", "weights_2", "bias_2", "confidence")}
        normal = graph("Div", graph("Sub", seen, own["origin"]), own["scale"])
        hidden = graph("Tanh", graph("Add", graph("MatMul", normal, own["weights_1"]), own["bias_1"]))
        chance = graph("Sigmoid", graph("Add", graph("MatMul", hidden, own["weights_2"]), own["bias_2"]))
        parts.append(graph("GreaterOrEqual", chance, own["confidence"]))
    return graph("Concat", *parts, axis=-1)


def _follower(graph: Graph, data: ControllerData, seen: str, memory: dict[str, str], line: str) -> Step:
    arrays = data.arrays
    places = graph("Div", _shown(graph, data, seen), arrays["unit"])
    memory = _found_again(graph, data, places, memory, line)
    pointer, stalled = _advanced(graph, data, _unwound(graph, data, places, memory["pointer"], line), memory, line)
    unwound = _unwound(graph, data, places, pointer, line)
    ahead = graph("Flatten", _ahead(graph, line, unwound, pointer, arrays["distances"]))
    moved = _moved(graph, data, seen, graph("Mul", graph("Sub", unwound, places), arrays["unit"]))
    normal = graph("Div", graph("Sub", moved, arrays["origin"]), arrays["scale"])
    inputs = graph("Concat", normal, ahead, _share(graph, data, stalled), axis=-1)
    past = graph.cast(graph("GreaterOrEqual", graph("Unsqueeze", pointer, [1]), arrays["firsts"]), np.int64)
    chosen = graph("Sub", graph("ReduceSum", past, [-1], keepdims=0), 1)
    return inputs, chosen, {"pointer": pointer, "stalled": stalled}


def _shown(graph: Graph, data: ControllerData, seen: str) -> str:
    """Return the features [B, F] that observations show: entries, and angles by cosine and sine."""
    entries, sines = data.arrays["entries"], data.arrays.get("sines")
    if sines is None:
        return graph.columns(seen, entries)
    return graph("Concat", *(_angle(graph, graph.columns(seen, [entry]), graph.columns(seen, [sine]))
                             if sine >= 0 else graph.columns(seen, [entry])
                             for entry, sine in zip(entries, sines, strict=True)), axis=-1)


def _angle(graph: Graph, x: str, y: str) -> str:
    """Return the angles of vectors (x, y), in [-pi, pi]; ONNX has no arctan2.

    The tangent of half of the angle is y / (r + x) where x >= 0, elsewhere (r - x) / y; infinite for y = 0.
    """
    length = graph("Sqrt", graph("Add", graph("Mul", x, x), graph("Mul", y, y)))
    right = graph("GreaterOrEqual", x, 0.0)
    ahead = graph("Div", y, graph("Max", graph("Add", length, x), np.finfo(np.float64).tiny))
    behind = graph("Div", graph("Sub", length, x), graph("Abs", y))
    half = graph.cast(graph("Atan", graph.cast(graph("Where", right, ahead, behind), np.float32)), np.float64)
    sign = graph("Where", graph("And", graph("Less", x, 0.0), graph("Less", y, 0.0)), -2.0, 2.0)
    return graph("Mul", half, sign)


def _unwound(graph: Graph, data: ControllerData, places: str, pointer: str, line: str) -> str:
    """Return places [B, F] moved by whole periods to where they are nearest to the points at pointers [B]."""
    periods = data.arrays.get("periods")
    if periods is None:
        return places
    away = graph("Sub", places, graph("Gather", line, pointer, axis=0))
    turns = graph("Round", graph("Div", away, np.where(periods > 0.0, periods, np.inf)))
    return graph("Sub", places, graph("Mul", turns, periods))


def _moved(graph: Graph, data: ControllerData, seen: str, shifts: str) -> str:
    """Return observations [B, O] of which the entries that are the feature are larger by `shifts` [B, F]."""
    arrays = data.arrays
    if "periods" not in arrays:
        return seen
    onto = np.zeros((len(arrays["entries"]), len(data.words["observation"])))
    plain = np.flatnonzero(arrays["sines"] < 0) if "sines" in arrays else np.arange(len(onto))
    onto[plain, arrays["entries"][plain]] = 1.0
    return graph("Add", seen, graph("MatMul", shifts, onto))


def _last(graph: Graph, line: str) -> str:
    """Return the pointer of the end of a line."""
    return graph("Sub", graph("Gather", graph("Shape", line), 0, axis=0), 1)


def _advanced(graph: Graph, data: ControllerData, places: str, memory: dict[str, str], line: str) -> tuple[str, str]:
    """Return the pointers [B] after a step, and how long they have stood still [B]."""
    reach = np.arange(data.words["reach"] + 1)
    candidates = graph("Min", graph("Add", graph("Unsqueeze", memory["pointer"], [1]), reach), _last(graph, line))
    away = graph("Sub", graph("Gather", line, candidates, axis=0), graph("Unsqueeze", places, [1]))
    squares = graph("ReduceSum", graph("Mul", away, away), [-1], keepdims=0)
    nearest = graph("ArgMin", _passable(graph, squares, data), axis=1, keepdims=1)
    pointer = graph("Squeeze", graph("GatherElements", candidates, nearest, axis=1), [1])
    stood = graph("Add", memory["stalled"], 1)
    return pointer, graph("Where", graph("Greater", pointer, memory["pointer"]), np.array(0), stood)


def _found_again(graph: Graph, data: ControllerData, places: str, memory: dict[str, str], line: str) -> dict[str, str]:
    """Return the memory; pointers that stood still for long are at the nearest point that they have passed."""
    longest = data.words["lost_after"]
    if not longest:
        return memory
    pointer = graph("Unsqueeze", memory["pointer"], [1])
    away = graph("Sub", graph("Unsqueeze", line, [0]),
                 graph("Unsqueeze", _unwound(graph, data, places, memory["pointer"], line), [1]))
    squares = graph("ReduceSum", graph("Mul", away, away), [-1], keepdims=0)
    numbers = graph("Range", np.array(0), graph("Add", _last(graph, line), 1), np.array(1))
    nearest = graph("ArgMin", graph("Where", graph("Greater", numbers, pointer), np.inf, squares), axis=1, keepdims=0)
    lost = graph("GreaterOrEqual", memory["stalled"], np.array(longest))
    return {"pointer": graph("Where", lost, nearest, memory["pointer"]),
            "stalled": graph("Where", lost, np.array(-1), memory["stalled"])}


def _passable(graph: Graph, squares: str, data: ControllerData) -> str:
    """Return squared distances [B, N] of points ahead, infinite from where a pointer may not pass (`Line.advance`)."""
    numbers = np.arange(data.words["reach"] + 1)
    before, after = (graph("Gather", squares, chosen, axis=1) for chosen in (numbers[:-1], numbers[1:]))
    barred = graph("And", graph("Greater", after, before),
                   graph("Greater", after, data.arrays["pass_radius"] ** 2))
    beyond = graph("Greater", graph("CumSum", graph.cast(barred, np.int64), np.array(1)), np.array(0))
    return graph("Concat", graph("Gather", squares, numbers[:1], axis=1), graph("Where", beyond, np.inf, after), axis=1)


def _ahead(graph: Graph, line: str, places: str, pointer: str, distances: Any) -> str:
    """Return points of a line ahead, relative to places [B, K, 2]."""
    at = graph("Min", graph("Add", graph("Unsqueeze", pointer, [1]), np.atleast_1d(distances)), _last(graph, line))
    return graph("Sub", graph("Gather", line, at, axis=0), graph("Unsqueeze", places, [1]))


def _share(graph: Graph, data: ControllerData, stalled: str) -> str:
    waited = graph("Div", graph.cast(stalled, np.float64), float(data.words["patience"]))
    return graph("Unsqueeze", graph("Min", waited, 1.0), [1])


def _robot(graph: Graph, data: ControllerData, seen: str, memory: dict[str, str], line: str) -> Step:
    words, arrays = data
    places = graph("Div", graph.columns(seen, arrays["entries"]), arrays["unit"])
    found = _found_again(graph, data, places, memory, line)
    pointer, stalled = _advanced(graph, data, _unwound(graph, data, places, found["pointer"], line), found, line)
    places = _unwound(graph, data, places, pointer, line)
    side = _leading(graph, data, seen, graph("Squeeze", _ahead(graph, line, places, pointer, arrays["half"]), [1]),
                    memory["side"])
    matrix = graph("Gather", arrays["side_observations"], side, axis=0)
    own = graph("Squeeze", graph("MatMul", matrix, graph("Unsqueeze", seen, [2])), [2])
    c, s = _heading(graph, data, own)
    ahead = _ahead(graph, line, places, pointer, arrays["distances"])
    x, y = graph.columns(ahead, [0]), graph.columns(ahead, [1])
    forward, left = _rotated(graph, x, y, graph("Unsqueeze", c, [1]), graph("Neg", graph("Unsqueeze", s, [1])))
    turned = [graph.columns(ahead, [2])] if len(arrays["entries"]) > 2 else []
    view = graph("Flatten", graph("Concat", forward, left, *turned, axis=-1))
    kept = arrays.get("body", np.delete(np.arange(len(words["observation"])), arrays["entries"][:2]))
    body = graph("Concat", *_turned(graph, data, own, kept, c, graph("Neg", s)), axis=-1)
    normal = graph("Div", graph("Sub", body, arrays["origin"]), arrays["scale"])
    inputs = graph("Concat", normal, view, _share(graph, data, stalled), axis=-1)
    bounded = graph("Min", graph("Max", inputs, -deploy.LARGEST), deploy.LARGEST)
    return bounded, graph("Mul", side, 0), {"pointer": pointer, "stalled": stalled, "side": side}


def _shaken(graph: Graph, data: ControllerData, seen: str, controls: str, stalled: str) -> str:
    """Return controls [B, A], in which robots that have fallen shake, and cars that are stuck."""
    words, waves = data.words, data.arrays["waves"]
    if words["burst"]:
        over = graph("Sub", graph("Unsqueeze", stalled, [1]), words["patience"])
        bursts = graph("Mod", graph("Div", over, words["burst"]), 2)
        swinging = graph("And", graph("GreaterOrEqual", over, 0), graph("Equal", bursts, 0))
    elif words["speeds"]:
        quaternion = graph.columns(seen, range(3, 7))
        lean = graph("MatMul", graph("Mul", quaternion, quaternion), deploy.LEAN[:, None])
        swinging = graph("Less", lean, 0.0)
    else:
        return controls
    return graph("Where", swinging, graph("Gather", waves, graph("Mod", stalled, len(waves)), axis=0), controls)


def _leading(graph: Graph, data: ControllerData, seen: str, far: str, before: str) -> str:
    """Return which side of a robot looks along the line [B], given the point half-way ahead [B, 2]."""
    sides = data.arrays["side_observations"]
    if len(sides) == 1:
        return graph("Mul", before, 0)
    x, y = _unit(graph, graph.columns(far, [0]), graph.columns(far, [1]))
    cosines = []
    for one in sides:
        c, s = _heading(graph, data, graph("MatMul", seen, one.T))
        cosines.append(graph("Add", graph("Mul", c, x), graph("Mul", s, y)))
    along = graph("Concat", *cosines, axis=-1)
    known = graph("Unsqueeze", graph("Max", before, 0), [1])
    kept = graph("And", graph("GreaterOrEqual", graph("GatherElements", along, known, axis=1), deploy.KEEP_SIDE),
                 graph("GreaterOrEqual", graph("Unsqueeze", before, [1]), 0))
    best = graph("ArgMax", along, axis=1, keepdims=1)
    return graph("Squeeze", graph("Where", kept, graph("Unsqueeze", before, [1]), best), [1])


def _heading(graph: Graph, data: ControllerData, seen: str) -> tuple[str, str]:
    """Return cosine and sine [B, 1] of where a robot looks; see `deploy.RobotFrame`."""
    if data.words["angle"] >= 0:
        angle = graph.columns(seen, [data.words["angle"]])
        return graph("Cos", angle), graph("Sin", angle)
    if not data.words["speeds"]:
        zero = graph("Mul", graph.columns(seen, [0]), 0.0)
        return graph("Add", zero, 1.0), zero
    w, x, y, z = (graph.columns(seen, [entry]) for entry in range(3, 7))
    ahead = graph("Sub", graph("Add", graph("Mul", w, w), graph("Mul", x, x)),
                  graph("Add", graph("Mul", y, y), graph("Mul", z, z)))
    return _unit(graph, ahead, graph("Mul", graph("Add", graph("Mul", w, z), graph("Mul", x, y)), 2.0))


def _unit(graph: Graph, x: str, y: str) -> tuple[str, str]:
    """Return cosine and sine of the directions of vectors; those of the x axis for a vector of no length."""
    length = graph("Sqrt", graph("Add", graph("Mul", x, x), graph("Mul", y, y)))
    none = graph("Equal", length, 0.0)
    safe = graph("Where", none, 1.0, length)
    return graph("Where", none, 1.0, graph("Div", x, safe)), graph("Div", y, safe)


def _rotated(graph: Graph, x: str, y: str, c: str, s: str) -> tuple[str, str]:
    """Return vectors turned by an angle of cosine c and sine s."""
    return (graph("Sub", graph("Mul", c, x), graph("Mul", s, y)), graph("Add", graph("Mul", s, x), graph("Mul", c, y)))


def _turned(graph: Graph, data: ControllerData, seen: str, kept: Any, c: str, s: str) -> list[str]:
    """Return some entries of observations in a turned world, each [B, 1]; see `deploy.RobotFrame.turned`."""
    speeds = data.words["speeds"]
    if not speeds:
        return [graph.columns(seen, kept)]
    larger = graph("Sqrt", graph("Div", graph("Add", graph("Abs", c), 1.0), 2.0))
    smaller = graph("Div", graph("Abs", s), graph("Mul", larger, 2.0))
    ahead = graph("GreaterOrEqual", c, 0.0)
    sign = graph("Where", graph("Less", s, 0.0), -1.0, 1.0)
    h = graph("Where", ahead, larger, smaller)
    k = graph("Mul", sign, graph("Where", ahead, smaller, larger))
    w, x, y, z = (graph.columns(seen, [entry]) for entry in range(3, 7))
    first, last = _rotated(graph, w, z, h, k)
    second, third = _rotated(graph, x, y, h, k)
    flip = graph("Where", graph("Less", first, 0.0), -1.0, 1.0)
    quaternion = [graph("Mul", part, flip) for part in (first, second, third, last)]
    speed = _rotated(graph, graph.columns(seen, [speeds]), graph.columns(seen, [speeds + 1]), c, s)
    changed = {**dict(zip(range(3, 7), quaternion, strict=True)), speeds: speed[0], speeds + 1: speed[1]}
    return [changed.get(entry) or graph.columns(seen, [entry]) for entry in kept.tolist()]
