"""Planner Arena, started on this machine, opens the database of a comparison and draws from it."""

import json
import os
import socket
import subprocess
import sys
import time
from importlib.metadata import version
from urllib.request import urlopen

import pytest

from pbcs_ompl.experiments.compare import compare

pytestmark = pytest.mark.slow
REASON = "Planner Arena is not installed: pip install 'pbcs-ompl[arena]'"
MAZE = "pbcs/Maze-v0"
SIZE = {"width": 600, "height": 400, "hidden": False}


@pytest.fixture
def address(tmp_path):
    """Compare two planners in two mazes, start Planner Arena on the database, and shut it down after the test."""
    pytest.importorskip("plannerarena", reason=REASON)
    found = compare(["Ex", "RandomWalk"], MAZE, env_kwargs=[{"size": 2}, {"size": 3}], seeds=3, max_transitions=5000,
                    out=tmp_path / "out")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "shiny", "run", "--host", "127.0.0.1", "--port", str(port), "plannerarena.app:app"]
    arena = subprocess.Popen(command, env={**os.environ, "DATABASE": found.database}, cwd=tmp_path)
    yield f"127.0.0.1:{port}"
    arena.terminate()
    arena.wait(30)


def page(address, path="", seconds=60.0):
    """Return a page, as soon as there is one."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            with urlopen(f"http://{address}/{path}", timeout=10) as answer:
                assert answer.status == 200
                return answer.read().decode()
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.2)


def outputs(address, names, inputs):
    """Open a session as a browser does and return what the app shows for some of its outputs."""
    connect = pytest.importorskip("websockets.sync.client", reason=REASON).connect
    shown = {f".clientdata_output_{name}_{key}": value for name in names for key, value in SIZE.items()}
    values = {}
    with connect(f"ws://{address}/websocket/", max_size=None) as session:
        session.send(json.dumps({"method": "init", "data": {"database": None, ".clientdata_pixelratio": 1,
                                                            **inputs, **shown}}))
        while not values.keys() >= set(names):
            message = json.loads(session.recv(timeout=60))
            assert not message.get("errors"), message["errors"]
            values |= message.get("values", {})
    return values


def test_planner_arena_opens_the_database(address):
    home = page(address)
    for part in ("Planner Arena", "Overall performance", "Progress", "Database info"):
        assert part in home
    problem = f"{MAZE}(size=3)"
    chosen = {"problem": problem, "version": f"OMPL {version('ompl')}", "planners": ["Ex", "RandomWalk"]}
    inputs = {f"{page}-{name}": value for page in ("performance", "progress") for name, value in chosen.items()}
    inputs |= {f"performance-{name}": False for name in ("show_as_cdf", "show_simplified", "hide_outliers",
                                                         "y_log_scale")}
    inputs |= {"performance-attribute": "collision checks", "progress-attribute": "coverage",
               "progress-show_measurements": False}
    found = outputs(address, ["performance-problem_ui", "performance-attribute_ui", "performance-plot",
                              "performance-missing_data_table", "progress-plot"], inputs)
    assert problem in found["performance-problem_ui"]["html"]
    for column in ("transitions", "collision checks", "path length", "replay ok", "coverage"):
        assert f">{column}</option>" in found["performance-attribute_ui"]["html"]
    assert found["performance-missing_data_table"]["payload"]["data"] == [["Ex", 0, 3], ["RandomWalk", 0, 3]]
    for plot in ("performance-plot", "progress-plot"):
        assert found[plot]["src"].startswith("data:image/png;base64,")
