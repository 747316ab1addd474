"""The scene in three dimensions: where things lie, what moves, and that the page needs nothing from elsewhere."""

import json
import re
import shlex
import shutil
import subprocess
import time

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.figures.bodies import bodies_in
from pbcs_ompl.figures.scene import Places, scene_page

pytest.importorskip("viser")
MAZE = "--env pbcs/Maze-v0 --env-kwargs '{\"size\": 2}'"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return a folder with a plan, `plan`, and a training along it, `train`."""
    root = tmp_path_factory.mktemp("view")
    assert main(shlex.split(f"plan {MAZE} --no-pictures --out {root / 'plan'}")) == 0
    assert main(shlex.split(f"train {MAZE} --path {root / 'plan'} --out {root / 'train'}")) == 0
    return root


@pytest.mark.parametrize("kind", ["plan", "train"])
def test_view_writes_one_page_that_needs_nothing_from_elsewhere(folders, kind, capsys):
    capsys.readouterr()
    for _ in range(2):  # an older view is replaced
        assert main(["view", str(folders / kind), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (shown["plan"], shown["tree"], shown["controller"]) == (True, kind == "plan", kind == "train")
    page = (folders / kind / "view.html").read_text()
    assert page.count("</html>") == 1
    assert not re.findall(r"""<(?:script|link|img|iframe)[^>]+(?:src|href)=["'](?!data:)""", page)


def test_other_files_and_other_folders_are_refused(folders, tmp_path, capsys):
    other = tmp_path / "notes.html"
    other.write_text("mine")
    assert main(["view", str(folders / "plan"), "--out", str(other)]) == 2
    assert "was not written by pbcs view" in capsys.readouterr().err
    assert other.read_text() == "mine"
    assert main(shlex.split(f"eval {folders / 'train'} --episodes 2 --out {tmp_path / 'eval'}")) == 0
    assert main(["view", str(tmp_path / "eval")]) == 2
    assert "pbcs view shows those of plan and train" in capsys.readouterr().err


def test_walls_keep_their_lengths_and_other_dimensions_are_drawn_equally_long():
    maze = pbcs_ompl.make("pbcs/Maze-v0", {"size": 3})
    assert np.array_equal(Places.of(maze, own_lengths=True)(np.array([[1.5, 2.5]])), [[1.5, 2.5, 0.0]])
    car = pbcs_ompl.make("MountainCarContinuous-v0")
    places = Places.of(car, own_lengths=False)
    corners = places.of_features(np.array([car.feature_low, car.feature_high]))
    assert np.allclose(corners, [[0, 0, 0], [10, 10, 0]])


def test_bodies_stand_where_the_feature_says():
    pytest.importorskip("mujoco")
    ant = pbcs_ompl.make("pbcs/AntMaze-v0")
    states = [ant.initial_state(seed) for seed in range(3)]
    bodies = bodies_in(ant, np.array(states))
    assert np.allclose(bodies.positions[:, 0, :2], ant.feature(np.array(states))[:, :2])
    assert np.allclose(np.linalg.norm(bodies.turns, axis=2), 1)
    assert bodies_in(pbcs_ompl.make("pbcs/Maze-v0", {"size": 2}), np.zeros((1, 2))) is None
    page = scene_page(ant, path=np.array(states))
    assert len(page) < 3_000_000


def test_bodies_whose_places_are_not_the_feature_are_left_out():
    pytest.importorskip("mujoco")
    reacher = pbcs_ompl.make("Reacher-v5", feature="qpos[0:2]", goal="reward>1")  # two angles
    states = [reacher.initial_state(0)]
    for _ in range(10):
        states.append(reacher.transition(states[-1][None], np.ones((1, 2))).states[0])
    assert bodies_in(reacher, np.array(states)) is None


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here (Debian: apt-get install chromium)")
def test_chromium_draws_the_page_and_asks_for_nothing(folders, tmp_path):
    assert main(["view", str(folders / "plan"), "--out", str(tmp_path / "page.html")]) == 0
    quiet = ["--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
             "--disable-sync"]
    command = [CHROMIUM, "--headless", "--no-sandbox", *quiet, "--enable-unsafe-swiftshader", "--enable-logging=stderr",
               f"--user-data-dir={tmp_path / 'profile'}", f"--log-net-log={tmp_path / 'net.json'}",
               "--remote-debugging-port=0", (tmp_path / "page.html").as_uri()]
    log = tmp_path / "log.txt"
    with log.open("w") as file, subprocess.Popen(command, stderr=file) as browser:
        try:
            for _ in range(300):
                if "Embedded data loaded" in log.read_text():
                    break
                time.sleep(0.2)
            time.sleep(2.0)
        finally:
            browser.terminate()
    said = log.read_text()
    assert "Embedded data loaded" in said
    assert "WebGL support: true" in said
    assert "Uncaught" not in said
    asked = re.findall(r'"url":"(https?://[^"]+)"', (tmp_path / "net.json").read_text())
    assert not [url for url in asked if "gvt1" not in url and "google" not in url], asked
