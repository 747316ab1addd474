"""Presets are data; wrong settings are named."""

import pytest

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.skills.config import METHODS, TrainConfig
from pbcs_ompl.skills.settings import SkillSettings, skill_preset


def test_the_thesis_preset_is_the_thesis():
    settings = skill_preset("thesis")
    assert (settings.alpha, settings.beta, settings.max_steps, settings.epsilon) == (10, 50, 50, 0.1)
    assert (settings.min_stride, settings.max_stride, settings.shorten, settings.verify_episodes) == (1, 1, False, 0)
    assert settings.shaped
    assert not skill_preset("thesis", "pb").shaped


def test_every_preset_is_valid_for_every_method():
    for preset in ("thesis", "fast"):
        for method in METHODS:
            assert isinstance(skill_preset(preset, method), SkillSettings)


@pytest.mark.parametrize(("changes", "hint"), [
    ({"alfa": 3}, "did you mean 'alpha'"), ({"alpha": 0}, "at least 1"), ({"epsilon": 1.5}, "within"),
    ({"radius": -1.0}, "greater than 0"), ({"alpha": "3"}, "expected int"), ({"shaped": 1}, "expected bool"),
    ({"alpha": True}, "expected int"), ({"min_stride": 9, "max_stride": 3}, "at least min_stride"),
])
def test_wrong_settings_are_named(changes, hint):
    with pytest.raises(InvalidOption, match=hint):
        SkillSettings().updated(changes)


@pytest.mark.parametrize(("options", "hint"), [
    ({"method": "pbc"}, "did you mean 'pbcs'"), ({"preset": "fats"}, "did you mean 'fast'"),
])
def test_unknown_names_are_met_with_the_closest(options, hint):
    with pytest.raises(UnknownName, match=hint):
        TrainConfig(**options)
