"""What an action costs: the controller of the toolkit, the NumPy file, and the ONNX graph where there is onnxruntime.

    python tests/benchmarks/controller_speed.py

The networks are random, of (64, 64) but for the ant that comes with the package. The best of 100 rounds that
alternate, one episode, one thread.
"""

# ruff: noqa: E402
import os
import sys
import tempfile
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from pbcs_ompl.deploy import Controller
from pbcs_ompl.results.export.controller_data import controller_data
from tests.results.export.controllers import CASES, Case

ROUNDS = 100


def steps_of(case: Case) -> dict:
    """What makes one step, by name; each begins again when it is called with None."""
    data = controller_data(case.controller, case.line)
    ours = case.controller.controller() if case.line is None else case.controller.controller(case.line)
    steps = {"toolkit": ours, "NumPy file": Controller(*data)}
    return {name: (one.reset, one.act) for name, one in steps.items()} | onnx_steps(case, data)


def onnx_steps(case: Case, data) -> dict:
    try:
        import onnxruntime

        from pbcs_ompl.results.export.onnx_controller import write_onnx
    except ModuleNotFoundError:
        return {}
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    with tempfile.TemporaryDirectory() as folder:
        (path,) = write_onnx(data, Path(folder))
        session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    line = {} if case.line is None else {"line": case.line.points}
    names = list(data.words["memory"])
    memory: dict = {}

    def reset() -> None:
        memory.update({name: np.array([first]) for name, first in data.words["memory"].items()})

    def act(observation: np.ndarray) -> np.ndarray:
        action, *after = session.run(None, {"observation": observation[None], **line, **memory})
        memory.update(zip(names, after, strict=True))
        return action[0]

    return {"onnxruntime": (reset, act)}


def main() -> None:
    print(f"{'controller':<28}{'toolkit':>10}{'NumPy file':>12}{'onnxruntime':>13}   us an action")
    for name, make in CASES.items():
        case = make()
        row, steps = case.observations[:, 0], steps_of(case)
        seconds: dict = {kind: [] for kind in steps}
        for _ in range(ROUNDS):
            for kind, (reset, act) in steps.items():
                reset()
                began = time.perf_counter()
                for observation in row:
                    act(observation)
                seconds[kind].append((time.perf_counter() - began) / len(row))
        found = {kind: 1e6 * min(times) for kind, times in seconds.items()}
        print(f"{name:<28}{found['toolkit']:>10.1f}{found['NumPy file']:>12.1f}"
              f"{found.get('onnxruntime', np.nan):>13.1f}")


if __name__ == "__main__":
    main()
