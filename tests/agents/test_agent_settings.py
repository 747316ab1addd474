"""Presets, settings out of range, devices that are not there."""

import subprocess
import sys

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import DDPG, DDPGSettings, preset_names
from pbcs_ompl.core.errors import InvalidOption, UnknownName, UnsupportedSpace


def test_presets_hold_what_the_sources_say() -> None:
    assert {"fast", "thesis", "thesis-chapter-4"} <= set(preset_names())
    thesis, chapter_4 = DDPGSettings.from_preset("thesis"), DDPGSettings.from_preset("thesis-chapter-4")
    assert thesis == DDPGSettings((400, 300), False, 1e-3, 1e-3, 100, 0.99, 0.995, 1_000_000)
    assert chapter_4 == DDPGSettings((64, 64), True, 1e-4, 1e-3, 64, 0.99, 0.99, 1_000_000)
    assert DDPGSettings.from_preset("fast") == DDPGSettings()
    assert DDPGSettings.from_preset("thesis", discount=0.9).discount == 0.9


def test_wrong_names_are_answered_with_the_closest() -> None:
    with pytest.raises(UnknownName, match="'thesis'"):
        DDPGSettings.from_preset("thesys")
    with pytest.raises(InvalidOption, match="'discount'"):
        DDPGSettings.from_preset("fast", dicsount=0.9)


@pytest.mark.parametrize("wrong", [
    {"discount": 1.0}, {"discount": -0.1}, {"discount": float("nan")}, {"polyak": 1.5}, {"batch_size": 0},
    {"hidden": ()}, {"hidden": (64, 0)}, {"replay_capacity": 0}, {"actor_learning_rate": 0.0},
    {"critic_learning_rate": -1.0},
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
