"""Every study of the package runs from end to end on a small sweep, and any part of its records can be analysed."""

import json
import sys
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from pbcs_ompl.experiments.claims import greater
from pbcs_ompl.experiments.studies.exploration_trees import study as trees
from pbcs_ompl.experiments.studies.presets import study as presets
from pbcs_ompl.experiments.studies.toy_analysis import study as toy
from pbcs_ompl.experiments.studies.toy_analysis.random_walk import found_by
from pbcs_ompl.experiments.studies.tree_pitfalls import study as pitfalls
from pbcs_ompl.experiments.study import find_study, study_ids
from pbcs_ompl.resettable import make

LOOP = {"steps": 100, "evaluate_every": 50, "patience": 1}
SMALL = {
    "deadlock": {
        "loop": LOOP, "stack": {"cpu": 1},
        "variants": {"ddpg-epsilon-greedy": {"agent": "ddpg", "noise": "epsilon-greedy"},
                     "ddpg-ornstein-uhlenbeck": {"agent": "ddpg", "noise": "ornstein-uhlenbeck", "expert_after": 50}},
        "drift": {"seeds": 2, "updates": 100, "every": 50, "transitions": 100}},
    "tree-pitfalls": {"paradox": {"ring": 16, "radius": 0.5, "expansions": 50}, "neighbours": {"sizes": [100, 300]},
                      "growth": {"planners": ["Ex", "RRTNH"], "sizes": [300, 1000]},
                      "est": {"sizes": [2], "max_transitions": 3000}},
    "toy-analysis": {"walks": 20_000, "steps": 22, "toy": {"agents": 50, "initialisation": "glorot"}},
    "exploration-trees": {"scenes": {
        "box": {"env": "pbcs/Box-v0", "transitions": 300},
        "disc": {"env": "pbcs/Disc-v0", "transitions": 300},
        "maze": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "transitions": 300}}},
    "offline-vs-bootstrapped": {
        "evaluate_every": 50, "episode_steps": 20, "stack": 1,
        "variants": {"plain": {"size": 2, "explored": 0, "updates": 0, "steps": 100, "figure": "4.1"},
                     "offline": {"size": 2, "explored": 200, "updates": 100, "steps": 0, "figure": "4.4"},
                     "bootstrapped": {"size": 2, "explored": 200, "updates": 0, "steps": 100, "figure": "4.5",
                                      "pictured": [50]}},
        "mini_batch": {"size": 2, "explored": 200, "count": 20}},
    "backplay-2x2": {"max_transitions": 3000, "alone": {"steps": 200, "discount": 0.9}},
    "maze-table": {
        "methods": {label: {"method": method, "agent": "ddpg", "max_transitions": 3000, "seeds": 1}
                    for label, method in {"PBCS": "pbcs", "Follow": "follow", "PB": "pb", "DDPG": "plain"}.items()},
        "sizes": {"2": {"episode_steps": 20, "seeds": 1}}},
    "pbcs-ablation": {"sizes": [2], "max_transitions": 3000,
                      "values": {"alpha": [1, 3], "beta": [5, 50], "radius": [0.1, 0.2]}},
    "ex-settings": {"bin_size": [0.15, 1.0], "batch": [1, 16],
                    "scenes": {"maze": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}}}},
    "rides-ablation": {"max_transitions": 5000, "without": ["rides", "learnt-scales"],
                       "peers": {"Ex": {"planner": "Ex"}},
                       "scenes": {"maze-2": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}}}},
    "half-cheetah-priming": {
        "episodes": 2, "primed_every": 2,
        "variants": {name: {"agent": "ddpg", "primed": name.endswith("primed")} for name in ("ddpg", "ddpg-primed")}},
    "skills-beyond-mazes": {"tasks": {
        name: {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "max_transitions": 3000, "seeds": 1}
        for name in ("small", "small-learnt", "again")}},
    "presets": {"max_transitions": 800, "sizes": [2], "changes": {
        "networks of 64 units": ["hidden"], "50 at once": ["episodes_per_batch", "updates_per_transition"]}},
    "antmaze-exploration": {"max_transitions": 100},
    "closed-loop": {
        "noise": [0.0, 0.1], "plan_transitions": 5000,
        "methods": {**{method: {"seeds": 1, "episodes": 2} for method in ("open-loop", "lqr", "follow")},
                    "mppi": {"seeds": 1, "episodes": 1}, "reverse-curriculum": {"seeds": 1, "episodes": 1}},
        "tasks": {"maze-2": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "max_transitions": 2000}}},
    "control-duration": {"max_transitions": 5000, "control_durations": [1, 3],
                         "scenes": {"maze-2": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}}}},
}
SLOW = ("antmaze-exploration", "backplay-2x2", "closed-loop", "deadlock", "exploration-trees", "half-cheetah-priming",
        "maze-table", "offline-vs-bootstrapped", "pbcs-ablation", "toy-analysis", "tree-pitfalls")


SIMULATED = ("antmaze-exploration", "half-cheetah-priming")


def draw_nothing(name, monkeypatch):
    """Let the analysis of a study write no files."""
    folder = f"pbcs_ompl.experiments.studies.{name.replace('-', '_')}"
    import_module(f"{folder}.analysis")
    for module in [module for place, module in sys.modules.items() if place.startswith(f"{folder}.")]:
        if "publish" in vars(module):
            monkeypatch.setattr(module, "publish", lambda figure, path: None)


def test_every_study_is_tested():
    assert set(study_ids()) == set(SMALL)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in SMALL])
def test_it_runs_and_its_claims_are_sentences_with_numbers(name, tmp_path, monkeypatch):
    if name in SIMULATED:
        pytest.importorskip("mujoco")
    original = find_study(name)
    study = replace(original, sweep=original.sweep | SMALL[name])
    records = [json.loads(json.dumps(original.run(run.settings))) for run in study.all_runs(1)]
    claims = study.analyse(records, tmp_path)
    pictures = list(tmp_path.glob("*.png"))
    assert pictures
    assert all(picture.with_suffix(".pdf").is_file() for picture in pictures)
    assert len(claims) >= 3
    for claim in claims:
        assert claim.agrees in (True, False, None)
        assert claim.numbers
        assert claim.source
    draw_nothing(name, monkeypatch)
    for part in range(1, len(records)):
        assert all(claim.agrees in (True, False, None) for claim in study.analyse(records[:part], tmp_path))


@pytest.mark.parametrize("name", SMALL)
def test_without_records_no_claim_is_decided(name, tmp_path, monkeypatch):
    draw_nothing(name, monkeypatch)
    assert {claim.agrees for claim in find_study(name).analyse([], tmp_path)} <= {None}


@pytest.mark.parametrize("name", SMALL)
def test_every_run_has_a_name_and_plain_settings(name):
    runs = find_study(name).all_runs()
    assert len({run.name for run in runs}) == len(runs) > 0


def test_the_changes_lead_from_one_preset_to_the_other_and_each_setting_changes_once():
    differ = {name for values in (presets.method_values, presets.agent_values)
              for name, value in values("thesis").items() if value != values("fast")[name]}
    changes = find_study("presets").sweep["changes"].values()
    assert sorted(differ) == sorted(setting for change in changes for setting in change)


def test_evenness_is_the_share_of_what_a_tree_fills_evenly():
    evenness = trees.evenness
    whole = np.ones(16)
    assert evenness(np.full(16, 3.0), whole) == pytest.approx(1.0)
    assert evenness(np.eye(16)[0], whole) == pytest.approx(1 / 16)
    assert evenness(np.repeat([5.0, 0.0], 8), whole) == pytest.approx(1 / 2)
    assert evenness(np.array([2.0, 1.0, 0.0]), np.array([1.0, 0.5, 0.0])) == pytest.approx(1.0)
    assert evenness(np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.5, 0.0])) < 0.99


def test_cells_know_how_much_of_them_can_be_reached():
    disc = make("pbcs/Disc-v0")
    states = np.random.default_rng(0).uniform(0.0, 5.0, (100_000, 2))
    states = states[disc.is_valid(states)]
    counts, areas = trees.cells(disc, states, 0.25)
    assert counts.sum() == len(states)
    assert areas.sum() * 0.25**2 == pytest.approx(np.pi * 1.25**2, rel=0.01)
    assert trees.evenness(counts, areas) == pytest.approx(1.0, abs=0.01)
    left, _ = trees.cells(disc, states[states[:, 0] < 1.75], 0.25)
    assert trees.evenness(left, areas) == pytest.approx(0.5, abs=0.01)
    assert trees.coverage(left, areas) == pytest.approx(0.5)
    assert trees.density(states, (1.75, 1.75, 1.0)) == pytest.approx(100_000 / 25, rel=0.05)


def test_theorem_5_as_printed_by_hand():
    """Without pauses it is the walk. With p = 1/2: P_1 = 1/2 below 0, P_2 = 1/4, so (1/2 1/4) / (1 - 1/2 1/2) = 1/6."""
    np.testing.assert_allclose(toy.theorem_5(10, 1.0), found_by(10))
    np.testing.assert_allclose(toy.theorem_5(2, 0.5), [1 / 2, 1 / 2 + 1 / 2 * 1 / 6])


@pytest.mark.parametrize(("first", "second", "agrees"), [
    ({seed: 2.0 + seed for seed in range(5)}, {seed: 1.0 for seed in range(5)}, True),
    ({seed: 1.0 for seed in range(5)}, {seed: 2.0 + seed for seed in range(5)}, False),
    ({seed: 1.0 for seed in range(5)}, {seed: 1.0 for seed in range(5)}, None),
    ({seed: 1.0 for seed in range(10)}, {seed: 1.0 for seed in range(10)}, False),
    ({seed: 2.0 for seed in range(4)}, {seed: 1.0 for seed in range(9)}, None),
    ({}, {}, None)])
def test_greater_pairs_what_both_have(first, second, agrees):
    claim = greater("one is greater", first, second, ("one", "other"), "here")
    assert claim.agrees is agrees
    assert claim.numbers["greater"]["n"] == len(first)
    assert bool(claim.note) == (agrees is None)


def test_a_k_d_tree_in_random_order_is_logarithmic_and_in_sorted_order_a_list():
    rng = np.random.default_rng(0)
    points = rng.random((4000, 2))
    assert pitfalls.depths_in_kd_tree(points).mean() < 2.0 * np.log2(4000)
    line = np.repeat(np.arange(100.0)[:, None], 2, axis=1)
    np.testing.assert_array_equal(pitfalls.depths_in_kd_tree(line), np.arange(100))


@pytest.mark.parametrize(("size", "steps"), [(2, 11), (3, 43)])
def test_the_fewest_steps_through_a_maze(size, steps):
    assert trees.fewest_steps(make("pbcs/Maze-v0", {"size": size})) == steps


def test_a_task_of_closed_loop_may_have_fewer_seeds_and_methods():
    study = find_study("closed-loop")
    tasks = {"all": {"env": "pbcs/Disc-v0"}, "few": {"env": "pbcs/Disc-v0", "seeds": 2, "without": ["lqr"]}}
    methods = {"lqr": {"seeds": 3, "episodes": 1}, "follow": {"seeds": 3, "episodes": 1}}
    names = [run.name for run in replace(study, sweep=study.sweep | {"tasks": tasks, "methods": methods}).all_runs(20)]
    assert sorted(names) == sorted([f"all-{method}-{index}" for method in methods for index in range(3)]
                                   + ["few-follow-0", "few-follow-1"])
