"""Every study of the project runs from end to end on a sweep that was made small, and says what it found."""

import json
import tomllib

import numpy as np
import pytest

from pbcs_ompl.experiments.studies.toy_analysis.random_walk import found_by
from pbcs_ompl.experiments.study import find_study, study_ids
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import to_toml

LOOP = {"steps": 100, "evaluate_every": 50, "patience": 1}
SMALL = {
    "deadlock": {
        "loop": LOOP, "stack": {"cpu": 1},
        "variants": {"ddpg-epsilon-greedy": {"agent": "ddpg", "noise": "epsilon-greedy"},
                     "ddpg-ornstein-uhlenbeck": {"agent": "ddpg", "noise": "ornstein-uhlenbeck", "expert_after": 50}},
        "drift": {"seeds": 2, "updates": 100, "every": 50, "transitions": 100}},
    "toy-analysis": {"walks": 20_000, "steps": 22, "toy": {"agents": 50}},
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
                    for label, method in {"PBCS": "pbcs", "PB": "pb", "DDPG": "plain"}.items()},
        "sizes": {"2": {"episode_steps": 20, "seeds": 1}}},
    "pbcs-ablation": {"sizes": [2], "max_transitions": 3000,
                      "values": {"alpha": [1, 3], "beta": [5, 50], "radius": [0.1, 0.2]}},
    "ex-settings": {"bin_size": [0.15, 1.0], "batch": [1, 16],
                    "scenes": {"maze": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}}}},
    "half-cheetah-priming": {
        "episodes": 2, "primed_every": 2,
        "variants": {name: {"agent": "ddpg", "primed": name.endswith("primed")} for name in ("ddpg", "ddpg-primed")}},
    "skills-beyond-mazes": {"tasks": {
        name: {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "max_transitions": 3000, "seeds": 1}
        for name in ("small", "small-learnt", "again")}},
    "presets": {"max_transitions": 1500, "sizes": {"2": {"seeds": 1}}},
    "antmaze-exploration": {"max_transitions": 100},
    "control-duration": {"max_transitions": 5000, "control_durations": [1, 3],
                         "scenes": {"maze-2": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}}}},
}
SLOW = ("backplay-2x2", "deadlock", "exploration-trees", "half-cheetah-priming", "offline-vs-bootstrapped")


SIMULATED = ("antmaze-exploration", "half-cheetah-priming")


def test_every_study_is_tested():
    assert set(study_ids()) >= set(SMALL)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in SMALL])
def test_it_runs_and_its_claims_are_sentences_with_numbers(name, tmp_path):
    if name in SIMULATED:
        pytest.importorskip("mujoco")
    original = find_study(name)
    folder = tmp_path / name
    folder.mkdir()
    for part in (*original.folder.glob("*.py"), *original.folder.glob("*.npz")):
        (folder / part.name).write_bytes(part.read_bytes())
    sweep = tomllib.loads((original.folder / "sweep.toml").read_text()) | SMALL[name]
    (folder / "sweep.toml").write_text(to_toml(sweep))
    study, figures = find_study(str(folder)), tmp_path / "figures"
    figures.mkdir()
    records = [json.loads(json.dumps(study.run(settings))) for settings in study.runs(study.sweep, 1)]
    claims = study.analyse(records, figures)
    assert list(figures.glob("*.png"))
    assert len(claims) >= 3
    for claim in claims:
        assert claim.agrees in (True, False, None)
        assert claim.numbers
        assert claim.source


def test_evenness_is_the_share_of_what_a_tree_fills_evenly():
    evenness = find_study("exploration-trees").runs.__globals__["evenness"]
    whole = np.ones(16)
    assert evenness(np.full(16, 3.0), whole) == pytest.approx(1.0)
    assert evenness(np.eye(16)[0], whole) == pytest.approx(1 / 16)
    assert evenness(np.repeat([5.0, 0.0], 8), whole) == pytest.approx(1 / 2)
    assert evenness(np.array([2.0, 1.0, 0.0]), np.array([1.0, 0.5, 0.0])) == pytest.approx(1.0)
    assert evenness(np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.5, 0.0])) < 0.99


def test_cells_know_how_much_of_them_can_be_reached():
    scope = find_study("exploration-trees").runs.__globals__
    disc = make("pbcs/Disc-v0")
    states = np.random.default_rng(0).uniform(0.0, 5.0, (100_000, 2))
    states = states[disc.is_valid(states)]
    counts, areas = scope["cells"](disc, states, 0.25)
    assert counts.sum() == len(states)
    assert areas.sum() * 0.25**2 == pytest.approx(np.pi * 1.25**2, rel=0.01)
    assert scope["evenness"](counts, areas) == pytest.approx(1.0, abs=0.01)
    left, _ = scope["cells"](disc, states[states[:, 0] < 1.75], 0.25)
    assert scope["evenness"](left, areas) == pytest.approx(0.5, abs=0.01)
    assert scope["coverage"](left, areas) == pytest.approx(0.5)
    assert scope["density"](states, (1.75, 1.75, 1.0)) == pytest.approx(100_000 / 25, rel=0.05)


def test_theorem_5_as_printed_by_hand():
    """Without pauses it is the walk. With p = 1/2: P_1 = 1/2 below 0, P_2 = 1/4, so (1/2 1/4) / (1 - 1/2 1/2) = 1/6."""
    theorem_5 = find_study("toy-analysis").runs.__globals__["_theorem_5"]
    np.testing.assert_allclose(theorem_5(10, 1.0), found_by(10))
    np.testing.assert_allclose(theorem_5(2, 0.5), [1 / 2, 1 / 2 + 1 / 2 * 1 / 6])
