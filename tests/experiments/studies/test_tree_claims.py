"""The claims of the study of exploration trees on records whose truth is known."""

from pathlib import Path

from pbcs_ompl.experiments.study import find_study

PLANNERS = ("RRTSteered", "RRTNH", "Ex")


def claims_of(evenness, density, *, reward=1000, coverage=1.0, seeds=range(6)):
    """Return whether each claim holds; evenness and density have numbers for each scene and planner."""
    study = find_study("exploration-trees")
    study.analyse.__globals__["save"] = lambda figure, path: None
    records = [{"scene": scene, "planner": planner, "seed": seed, "first_reward": reward, "coverage": coverage,
                "evenness": evenness[scene][planner] + 0.001 * seed, "density": density[scene][planner]}
               for scene in ("box", "disc", "maze") for planner in PLANNERS for seed in seeds]
    return {claim.claim: claim.agrees for claim in study.analyse(records, Path())}


def table(box, disc):
    return {scene: dict(zip(PLANNERS, numbers, strict=True)) for scene, numbers in
            {"box": box, "disc": disc, "maze": (1, 1, 1)}.items()}


def test_trees_as_the_thesis_draws_them():
    claims = claims_of(table((0.9, 0.5, 0.6), (0.2, 0.3, 0.8)), table((80, 80, 80), (80, 100, 400)))
    assert claims == dict.fromkeys(claims, True)
    assert len(claims) == 9


def test_the_opposite_trees():
    claims = claims_of(table((0.4, 0.5, 0.3), (0.8, 0.7, 0.2)), table((80, 80, 80), (400, 400, 80)), reward=None,
                       coverage=0.5)
    assert claims == dict.fromkeys(claims, False)


def test_four_seeds_are_too_few_for_a_test():
    claims = claims_of(table((0.9, 0.5, 0.6), (0.2, 0.3, 0.8)), table((1, 1, 1), (1, 1, 9)), seeds=range(4))
    assert [agrees for claim, agrees in claims.items() if "more even" in claim] == [None] * 4
