"""The claims of the study beyond mazes on records whose truth is known."""

from pathlib import Path

from pbcs_ompl.experiments.study import find_study


def record(task, seed, solved):
    return {"task": task, "seed": seed, "solved": solved, "success_rate": float(solved), "skills": 3,
            "nominal_success_rate": float(solved), "steps_median": 50.0 if solved else None, "plan_transitions": 900,
            "train_transitions": 10_000, "updates": 100, "cpu_seconds": 1.0, "path_length": 70,
            "stalled": None if solved else "the budget is used up"}


def verdicts(**solved):
    """Claims about ten seeds of each task, of which so many are solved."""
    study = find_study("skills-beyond-mazes")
    study.analyse.__globals__["save"] = lambda figure, path: None
    rows = [record(task.replace("_", "-"), seed, seed < count) for task, count in solved.items() for seed in range(10)]
    return {claim.claim: claim for claim in study.analyse(rows, Path())}


def test_most_seeds_is_more_than_half():
    claims = verdicts(car=6, ant=5)
    assert claims["PBCS solves car in most seeds"].agrees
    assert not claims["PBCS solves ant in most seeds"].agrees
    assert claims["PBCS solves ant in most seeds"].note.count("the budget is used up") == 5
    assert claims["PBCS solves car in most seeds"].numbers["solved"]["successes"] == 6


def test_learnt_sets_are_compared_with_balls_of_the_same_task():
    claims = verdicts(maze=10, maze_learnt=9)
    assert set(claims) == {"PBCS solves maze in most seeds",
                           "on maze learnt activation sets do as well as balls (the intervals overlap)"}
    assert all(claim.agrees for claim in claims.values())
    assert not verdicts(maze=10, maze_learnt=2)[
        "on maze learnt activation sets do as well as balls (the intervals overlap)"].agrees


def test_every_run_of_the_sweep_has_a_name_and_untouched_seeds():
    study = find_study("skills-beyond-mazes")
    settings = study.runs(study.sweep, study.seeds)
    assert len({one["name"] for one in settings}) == len(settings)
    assert min(one["seed"] for one in settings) >= 200
