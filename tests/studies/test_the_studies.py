"""Every study of the project runs from end to end on a sweep that was made small, and says what it found."""

import tomllib

import numpy as np
import pytest

from pbcs_ompl.core.run_folder import to_toml
from pbcs_ompl.studies import find_study, run_study, study_ids
from pbcs_ompl.studies.random_walk import found_by

LOOP = {"steps": 100, "evaluate_every": 50, "patience": 1}
SMALL = {
    "deadlock": {
        "loop": LOOP, "stack": 1,
        "variants": {"ddpg-epsilon-greedy": {"agent": "ddpg", "noise": "epsilon-greedy"},
                     "ddpg-ornstein-uhlenbeck": {"agent": "ddpg", "noise": "ornstein-uhlenbeck", "expert_after": 50}},
        "drift": {"seeds": 2, "updates": 100, "every": 50, "transitions": 100}},
    "toy-analysis": {"walks": 20_000, "steps": 22, "toy": {"agents": 50}},
    "exploration-trees": {"scenes": {
        "box": {"env": "pbcs/Box-v0", "transitions": 300, "figure": "3.4"},
        "disc": {"env": "pbcs/Disc-v0", "transitions": 300, "figure": "3.4"},
        "maze": {"env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "transitions": 300, "figure": "4.3"}}},
    "offline-vs-bootstrapped": {
        "evaluate_every": 50, "episode_steps": 20, "stack": 1,
        "variants": {"plain": {"size": 2, "explored": 0, "updates": 0, "steps": 100, "figure": "4.1"},
                     "offline": {"size": 2, "explored": 200, "updates": 100, "steps": 0, "figure": "4.4"},
                     "bootstrapped": {"size": 2, "explored": 200, "updates": 0, "steps": 100, "figure": "4.5"}}},
}
SLOW = ("deadlock", "exploration-trees", "offline-vs-bootstrapped")


def test_every_study_is_tested():
    assert set(study_ids()) >= set(SMALL)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in SMALL])
def test_it_runs_and_its_claims_are_sentences_with_numbers(name, tmp_path):
    original = find_study(name)
    folder = tmp_path / name
    folder.mkdir()
    for script in ("study.py", "analysis.py"):
        (folder / script).write_text((original.folder / script).read_text())
    sweep = tomllib.loads((original.folder / "sweep.toml").read_text()) | SMALL[name]
    (folder / "sweep.toml").write_text(to_toml(sweep))
    result = run_study(find_study(str(folder)), out=tmp_path / "out", seeds=1)
    assert result.failed == {}
    assert result.figures
    assert len(result.agrees) >= 3
    for claim in result.agrees:
        assert claim.agrees in (True, False, None)
        assert claim.numbers
        assert claim.source


def test_evenness_is_one_for_a_uniform_tree_and_zero_for_one_cell():
    study = find_study("exploration-trees")
    evenness = study.runs.__globals__["evenness"]
    assert evenness(np.full(16, 3.0)) == pytest.approx(1.0)
    assert evenness(np.eye(16)[0]) == 0.0
    assert evenness(np.array([1.0, 1.0, 0.0, 0.0])) == pytest.approx(0.5)


def test_theorem_5_as_printed_by_hand():
    """Without pauses it is the walk. With p = 1/2: P_1 = 1/2 below 0, P_2 = 1/4, so (1/2 1/4) / (1 - 1/2 1/2) = 1/6."""
    theorem_5 = find_study("toy-analysis").runs.__globals__["_theorem_5"]
    np.testing.assert_allclose(theorem_5(10, 1.0), found_by(10))
    np.testing.assert_allclose(theorem_5(2, 0.5), [1 / 2, 1 / 2 + 1 / 2 * 1 / 6])
