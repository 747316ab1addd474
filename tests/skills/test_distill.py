"""One network does what a chain does; the judge measures both, and eval and export take what is written."""

import json
from pathlib import Path

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption, NotVerified
from pbcs_ompl.deploy import load
from pbcs_ompl.resettable import make
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.distill import DistillResult, distill
from tests.skills.path_following.test_follower import towards_the_line
from tests.skills.test_chain import round_the_corner

SMALL = {"width": 32, "updates": 300, "episodes": 20}


@pytest.fixture(scope="module")
def distilled(tmp_path_factory: pytest.TempPathFactory) -> DistillResult:
    out = tmp_path_factory.mktemp("distilled") / "run"
    return distill(round_the_corner(), settings=SMALL, seed=0, out=out, source="runs/maze")


def test_the_student_reaches_the_goal_as_its_teacher_does(distilled: DistillResult) -> None:
    assert distilled.solved
    assert distilled.chain.num_policies == 1
    assert distilled.student.episodes == distilled.teacher.episodes == 100
    assert distilled.student.wilson[1] >= distilled.teacher.wilson[0]
    again = pbcs_ompl.evaluate(distilled.chain, episodes=20, epsilon=0.1, seed=77)
    assert again.success_rate >= 0.8


def test_equal_seeds_give_equal_students(distilled: DistillResult) -> None:
    other = distill(round_the_corner(), settings=SMALL, seed=0)
    seen = np.random.default_rng(0).uniform(0, 2, (50, 2))
    np.testing.assert_array_equal(*(one.chain.skills[0].policy.act(seen) for one in (distilled, other)))
    assert other.transitions == distilled.transitions


def test_what_is_written_is_evaluated_exported_and_reported(distilled: DistillResult, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(distilled.out)
    assert main(["eval", folder, "--episodes", "3", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["success_rate"] == 1.0
    assert main(["export", folder, "--to", "numpy", "--out", str(tmp_path / "numpy")]) == 0
    controller = load(tmp_path / "numpy/controller.npz")
    np.testing.assert_allclose(controller.act(np.array([0.5, 0.5])),
                               SkillChain.load(Path(folder) / "chain").controller().act(np.array([0.5, 0.5])),
                               rtol=0, atol=1e-6)
    capsys.readouterr()
    assert main(["report", folder, "--out", str(tmp_path / "page.html"), "--json"]) == 0
    (shown,) = json.loads(capsys.readouterr().out)["folders"]
    assert (shown["kind"], shown["outcome"]) == ("distill", "solved")
    assert "pbcs distill runs/maze --seed 0" in (tmp_path / "page.html").read_text()


def test_a_followers_policies_become_one(tmp_path: Path) -> None:
    """It looks ahead on a line, the student does not: it has to know the way by the place alone."""
    from pbcs_ompl.resettable.actions import ActionMap
    from pbcs_ompl.skills.path_following.chain import FollowChain
    from pbcs_ompl.skills.path_following.follower import LineView
    from pbcs_ompl.skills.path_following.line import Line
    from pbcs_ompl.skills.path_following.shown_feature import ShownFeature
    from pbcs_ompl.skills.policy import ObservationTransform

    model = make("pbcs/Maze-v0", {"size": 2})
    line = Line.through(np.array([[5.0, 5.0], [15.0, 5.0], [15.0, 15.0], [5.0, 15.0]]), 0.5)
    view = LineView(ShownFeature.plain(np.array([0, 1])), np.array([0.1, 0.1]),
                    ObservationTransform(np.zeros(2), np.ones(2)), np.array([1.0, 2.0]), 2.0, 10)
    weights = towards_the_line(5.0)
    layer = np.zeros((view.size, 2), np.float32)
    layer[2, 0] = layer[3, 1] = 5.0
    policy = type(weights)(((layer, np.zeros(2, np.float32)),), model.action_low, model.action_high)
    teacher = FollowChain((policy,), (0,), line, view, np.array([0.5, 0.5]), model.spec, 200,
                          ActionMap.of(model.env.action_space), 0)
    found = distill(teacher, settings=SMALL)
    assert found.teacher.success_rate > 0.9
    assert found.student.success_rate > 0.9


def test_wrong_settings_and_unverifiable_teachers_are_refused() -> None:
    with pytest.raises(InvalidOption, match="width"):
        distill(round_the_corner(), settings={"widht": 3})
    whole = round_the_corner()
    lost = SkillChain(whole.skills, whole.start, whole.environment, 50, whole.actions, None)
    with pytest.raises(NotVerified, match="no reset"):
        distill(lost, settings=SMALL | {"rounds": 1})
