"""A training is a function of what its folder says: not of today's presets, and not silently of other versions."""

import shutil

import pytest

from pbcs_ompl.agents import settings as agents
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.results.files import read_toml, to_toml
from pbcs_ompl.skills import config, resume, settings, train
from pbcs_ompl.skills.training import training_versions

MAZE = {"size": 2}
OPTIONS = {"method": "pbcs", "env_kwargs": MAZE, "seed": 1}


class Stop:
    """A Ctrl-C at the n-th report of the training phase."""

    def __init__(self, count):
        self.left = count

    def __call__(self, numbers):
        self.left -= numbers["phase"] == "train"
        if not self.left:
            raise KeyboardInterrupt


def numbers(summary):
    return {name: value for name, value in summary.items() if name not in ("seconds", "out")}


def files(folder):
    """The bytes of a chain."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".safetensors", ".json")}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An uninterrupted training and its folder."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    return train("pbcs/Maze-v0", **OPTIONS, out=folder), folder


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """The folder of the same training, stopped in the middle."""
    folder = tmp_path_factory.mktemp("half") / "run"
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", **OPTIONS, out=folder, on_progress=Stop(10))
    return folder


@pytest.fixture
def stopped(half, tmp_path):
    """A copy of that folder."""
    return shutil.copytree(half, tmp_path / "run")


def edit(folder, changes):
    config = read_toml(folder / "config.toml")
    (folder / "config.toml").write_text(to_toml(config | changes))


def test_the_folder_holds_every_setting(whole):
    config = read_toml(whole[1] / "config.toml")
    assert (config["kind"], config["method"], config["agent"]) == ("train", "pbcs", "ddpg")
    assert (config["seed"], config["device"], config["max_transitions"]) == (1, "cpu", 10_000_000)
    assert config["environment"] == {"id": "pbcs/Maze-v0", "kwargs": MAZE}
    assert (config["preset"], set(config["preset_versions"])) == ("fast", {"skills", "agent"})
    assert config["settings"]["skill"]["alpha"] == 3
    assert config["settings"]["classifier"]["confidence"] == 0.9
    assert config["settings"]["criterion"]["robust_rate"] == 0.95
    assert config["agent_settings"]["hidden"] == [64, 64]
    assert config["planner"] == "Ex"
    assert {"batch", "bin_size"} <= set(config["planner_kwargs"])
    assert {"pbcs-ompl", "numpy", "ompl", "torch"} <= set(config["versions"])


def test_a_second_run_from_a_folder_gives_the_same_bits(whole, tmp_path):
    result, folder = whole
    config = read_toml(folder / "config.toml")
    names = ("method", "planner", "planner_kwargs", "agent", "settings", "agent_settings", "seed", "max_transitions",
             "device")
    again = train(EnvSpec.from_dict(config["environment"]), preset="thesis", out=tmp_path / "again",
                  **{name: config[name] for name in names})
    assert numbers(again.summary()) == numbers(result.summary())
    assert files(tmp_path / "again" / "chain") == files(folder / "chain")


def test_presets_that_changed_since_do_not_matter(whole, stopped, monkeypatch):
    before, agents_before = settings.read_preset("fast"), agents._read_preset("fast")
    changed = before | {"version": 99, "common": before["common"] | {"radius": 0.3, "beta": 20}}
    for module in (settings, config):
        monkeypatch.setattr(module, "read_preset", lambda name: changed)
    monkeypatch.setattr(agents, "_read_preset", lambda name: agents_before | {
        "version": 99, "common": {"hidden": [8], "discount": 0.5}})
    assert config.method_settings("pbcs").starts.radius == 0.3
    assert numbers(resume(stopped).summary()) == numbers(whole[0].summary())
    assert files(stopped / "chain") == files(whole[1] / "chain")


def test_other_versions_are_reported_and_the_folder_keeps_the_first_ones(whole, stopped):
    before = training_versions() | {"numpy": "1.0", "pbcs-ompl": "9.9"}
    edit(stopped, {"versions": before})
    now = training_versions()
    with pytest.warns(UserWarning, match="other versions") as caught:
        result = resume(stopped, max_transitions=9_000_000)
    (warning,) = [str(warning.message) for warning in caught if "other versions" in str(warning.message)]
    for name, old in (("numpy", "1.0"), ("pbcs-ompl", "9.9")):
        assert f"{name} {old} (now {now[name]})" in warning
    assert "torch" not in warning
    assert numbers(result.summary()) == numbers(whole[0].summary())
    config = read_toml(stopped / "config.toml")
    assert (config["versions"], config["max_transitions"]) == (before, 9_000_000)


@pytest.mark.parametrize("harm", [{"settings": {"alpha": 3}}, {"settings": 3}, {"agent_settings": {}}, {"kind": "plan"},
                                  {"environment": {}}, {"seed": "one"}, {"max_transitions": 0}])
def test_a_configuration_that_was_harmed_is_named(stopped, harm):
    edit(stopped, harm)
    with pytest.raises(DamagedFile, match=r"config\.toml"):
        resume(stopped)
