"""The whole controller is one graph, which onnxruntime computes as the toolkit does."""

import json
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.results.export.controller_data import controller_data
from pbcs_ompl.results.export.onnx_controller import write_onnx
from tests.results.export.controllers import CASES, Case, actions_of

pytest.importorskip("onnx")
onnxruntime = pytest.importorskip("onnxruntime")


def exported(case: Case, folder: Path) -> "onnxruntime.InferenceSession":
    (path,) = write_onnx(controller_data(case.controller, case.line), folder)
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def driven(session: "onnxruntime.InferenceSession", case: Case, episodes: int) -> np.ndarray:
    """What the graph does, [T, B, A]: its memory goes from each step into the next."""
    first = json.loads(session.get_modelmeta().custom_metadata_map["memory"])
    memory = {name: np.full(episodes, value, np.int64) for name, value in first.items()}
    line = {} if case.line is None else {"line": case.line.points}
    names, actions = [output.name for output in session.get_outputs()], []
    for observations in case.observations:
        done = dict(zip(names, session.run(None, {"observation": observations[:episodes], **line, **memory}),
                        strict=True))
        actions.append(done["action"])
        memory = {name: done[f"next_{name}"] for name in memory}
    return np.array(actions)


@pytest.mark.parametrize("kind", CASES)
def test_the_graph_does_the_same(kind: str, tmp_path: Path) -> None:
    if kind == "ant":
        pytest.importorskip("mujoco")
    case = CASES[kind]()
    session, expected = exported(case, tmp_path), actions_of(case)
    for episodes in (case.observations.shape[1], 1):
        found = driven(session, case, episodes)
        assert found.dtype == expected.dtype
        np.testing.assert_allclose(found, expected[:, :episodes], rtol=0, atol=1e-5)


def test_the_metadata_say_what_goes_in_and_out(tmp_path: Path) -> None:
    words = exported(CASES["follow chain"](), tmp_path).get_modelmeta().custom_metadata_map
    assert json.loads(words["observation"]) == ["obs[0]", "obs[1]"]
    assert json.loads(words["action"])["dtype"] == "float32"
    assert json.loads(words["memory"]) == {"pointer": 0, "stalled": -1}
    assert json.loads(words["environment"])["id"] == "pbcs/Maze-v0"
