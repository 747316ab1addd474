"""Presets are data; every constant of learning is a setting; wrong settings are named."""

from collections import Counter
from dataclasses import fields

import pytest

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.skills import method_settings, preset_names
from pbcs_ompl.skills.config import METHODS, TrainConfig
from pbcs_ompl.skills.settings import Settings, read_preset

CHOICES = {"method": "pbcs", "planner": None, "planner_kwargs": None, "agent": "ddpg", "preset": "fast",
           "settings": None, "agent_settings": None, "seed": 0, "max_transitions": 1000, "device": "cpu",
           "planned": False}


def test_the_thesis_preset_is_the_thesis():
    settings = method_settings("pbcs", "thesis")
    assert (settings.skill.alpha, settings.skill.min_stride, settings.skill.max_stride) == (10, 1, 1)
    assert (settings.episodes.beta, settings.episodes.max_steps, settings.episodes.epsilon) == (50, 50, 0.1)
    assert (settings.plan.remove_loops, settings.verify) == (False, False)
    assert (settings.skill.stop_at_success, settings.starts.reject_invalid) == (False, False)
    assert settings.episodes.shaped
    assert not method_settings("pb", "thesis").episodes.shaped


@pytest.mark.parametrize("preset", preset_names())
@pytest.mark.parametrize("method", METHODS)
def test_every_preset_is_valid_for_every_method_and_has_a_version(preset, method):
    assert isinstance(method_settings(method, preset), METHODS[method].settings)
    assert isinstance(read_preset(preset)["version"], int)


@pytest.mark.parametrize("method", METHODS)
def test_settings_and_back(method):
    settings = method_settings(method, "fast")
    assert type(settings).from_dict(settings.to_dict()) == settings
    assert method_settings(method, "thesis", settings.to_dict()) == settings


@pytest.mark.parametrize("method", METHODS)
def test_a_name_means_one_setting_and_is_documented(method):
    paths = METHODS[method].settings.paths()
    counts = Counter(path.rpartition(".")[2] for name, path in paths.items() if "." in name or name == path)
    assert set(counts.values()) == {1}
    groups = [METHODS[method].settings, *map(type, METHODS[method].settings.defaults().values())]
    for group in (group for group in groups if issubclass(group, Settings)):
        inherited = {part.name for base in group.__bases__ if base is not Settings for part in fields(base)}
        for part in fields(group):
            assert part.name in inherited or part.name in (group.__doc__ or "") or part.name in (
                "episodes", "starts", "criterion", "plan")


def test_a_setting_is_given_by_name_by_path_or_in_a_table():
    by_name = method_settings("pbcs", "fast", {"epsilon": 0.2, "alpha": 4})
    assert by_name == method_settings("pbcs", "fast", {"episodes.epsilon": 0.2, "skill.alpha": 4})
    assert by_name == method_settings("pbcs", "fast", {"episodes": {"epsilon": 0.2}, "skill": {"alpha": 4}})
    assert (by_name.episodes.epsilon, by_name.skill.alpha) == (0.2, 4)


@pytest.mark.parametrize(("changes", "hint"), [
    ({"alfa": 3}, "did you mean 'alpha'"), ({"alpha": 0}, "at least 1"), ({"epsilon": 1.5}, "within"),
    ({"radius": -1.0}, "greater than 0"), ({"alpha": "3"}, "expected int"), ({"shaped": 1}, "expected bool"),
    ({"alpha": True}, "expected int"), ({"min_stride": 9, "max_stride": 3}, "at least min_stride"),
    ({"episodes.epsilom": 0.1}, "did you mean 'episodes.epsilon'"), ({"episodes": 3}, "episodes"),
    ({"pretest": False}, "'pretest'; it is a setting of pb"), ({"window": 0.2}, "it is a setting of backplay"),
    ({"confidence": 2.0}, "within"), ({"activation": "box"}, "one of ball, classifier"),
])
def test_wrong_settings_are_named(changes, hint):
    with pytest.raises(InvalidOption, match=hint):
        method_settings("pbcs", "fast", changes)


@pytest.mark.parametrize(("options", "hint"), [
    ({"method": "pbc"}, "did you mean 'pbcs'"), ({"preset": "fats"}, "did you mean 'fast'"),
])
def test_unknown_names_are_met_with_the_closest(options, hint):
    with pytest.raises(UnknownName, match=hint):
        TrainConfig.resolve(**CHOICES | options)


@pytest.mark.parametrize("method", METHODS)
def test_a_configuration_and_back(method):
    config = TrainConfig.resolve(**CHOICES | {"method": method})
    assert TrainConfig.from_dict(config.to_dict()) == config
