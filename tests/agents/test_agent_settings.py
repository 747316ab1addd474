"""Presets, settings out of range, unavailable devices."""

import json
import subprocess
import sys
from dataclasses import fields
from importlib.resources import files

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import DDPG, DDPGSettings, SACSettings, TD3Settings, preset_names, preset_version
from pbcs_ompl.core.errors import InvalidOption, UnknownName, UnsupportedSpace


def test_presets_hold_what_the_sources_say() -> None:
    assert {"fast", "thesis", "thesis-chapter-4"} <= set(preset_names())
    thesis, chapter_4 = DDPGSettings.from_preset("thesis"), DDPGSettings.from_preset("thesis-chapter-4")
    assert thesis == DDPGSettings((400, 300), False, 1e-3, 1e-3, 100, 0.99, 0.995, 1_000_000, "glorot", "plain")
    assert chapter_4 == DDPGSettings((64, 64), True, 1e-4, 1e-3, 64, 0.99, 0.99, 1_000_000, "baselines", "baselines")
    assert DDPGSettings.from_preset("fast") == DDPGSettings()
    assert DDPGSettings.from_preset("thesis", discount=0.9).discount == 0.9


def test_every_preset_has_a_version_and_a_source_for_every_value() -> None:
    for name in preset_names():
        assert preset_version(name) >= 1
        lines = files("pbcs_ompl.agents").joinpath(f"{name}.toml").read_text().splitlines()
        values = [line for line in lines if "=" in line and not line.startswith(("#", "version"))]
        assert values
        assert all(" # " in line for line in values)
    with pytest.raises(UnknownName, match="'thesis'"):
        preset_version("thesys")


@pytest.mark.parametrize("kind", [DDPGSettings, TD3Settings, SACSettings])
def test_settings_survive_json_and_are_rebuilt_from_all_of_their_values(kind) -> None:
    settings = kind.from_preset("thesis", hidden=[7, 9], discount=0.5)
    values = json.loads(json.dumps(settings.to_dict()))
    assert kind.from_dict(values) == settings
    assert list(values) == [field.name for field in fields(kind)]
    for name in values:
        with pytest.raises(InvalidOption, match=name):
            kind.from_dict({other: value for other, value in values.items() if other != name})
        with pytest.raises(InvalidOption, match=name):
            kind.from_dict(values | {name: "much"})
    with pytest.raises(InvalidOption, match="'polyak'"):
        kind.from_dict(values | {"poliak": 0.5})


def test_an_algorithm_that_a_preset_does_not_know_gets_its_common_values() -> None:
    class Unknown(DDPGSettings):
        algorithm = "unknown-algorithm"

    assert Unknown.from_preset("thesis").hidden == (400, 300)
    with pytest.raises(InvalidOption, match="no settings for 'unknown-algorithm'"):
        Unknown.from_preset("thesis-chapter-4")


def test_errors_name_the_closest_name() -> None:
    with pytest.raises(UnknownName, match="'thesis'"):
        DDPGSettings.from_preset("thesys")
    with pytest.raises(InvalidOption, match="'discount'"):
        DDPGSettings.from_preset("fast", dicsount=0.9)


@pytest.mark.parametrize("wrong", [
    {"discount": 1.0}, {"discount": -0.1}, {"discount": float("nan")}, {"polyak": 1.5}, {"batch_size": 0},
    {"hidden": ()}, {"hidden": (64, 0)}, {"replay_capacity": 0}, {"actor_learning_rate": 0.0},
    {"critic_learning_rate": -1.0}, {"initialisation": "xavier"}, {"inputs": "normalised"},
])
def test_settings_out_of_range_are_named(wrong: dict) -> None:
    with pytest.raises(InvalidOption, match=next(iter(wrong))):
        DDPGSettings(**wrong)


def test_wrong_spaces_devices_and_options_are_refused() -> None:
    with pytest.raises(UnsupportedSpace, match="RescaleAction"):
        DDPG(2, [-1.0], [np.inf])
    with pytest.raises(UnsupportedSpace, match="low < high"):
        DDPG(2, [1.0], [1.0])
    with pytest.raises(InvalidOption, match="compile"):
        DDPG(2, [-1.0], [1.0], compile="yes")  # type: ignore[arg-type]
    with pytest.raises(InvalidOption, match="device"):
        DDPG(2, [-1.0], [1.0], device="abacus")
    if not torch.cuda.is_available():
        with pytest.raises(InvalidOption, match="no CUDA device"):
            DDPG(2, [-1.0], [1.0], device="cuda")


@pytest.mark.parametrize("library", ["torch", "safetensors"])
def test_a_missing_library_is_named_with_the_remedy(library: str) -> None:
    code = (f"import sys; sys.modules[{library!r}] = None\n"
            "from pbcs_ompl.core.errors import MissingDependency\n"
            "try:\n    import pbcs_ompl.agents\nexcept MissingDependency as error:\n    print(error)")
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert library in answer.stdout
    assert 'pip install "pbcs-ompl[rl]"' in answer.stdout
