"""For tests of planners and environments, ours and yours; the pytest plug-in is `pbcs_ompl.testing.plugin`.

    def test_my_planner(solve_rate):
        solve_rate("my_module:MyPlanner", "pbcs/Maze-v0", {"size": 5}, seeds=20, at_least=19, max_transitions=20_000)

    def test_my_environment():
        assert check_resettable(gymnasium.make("my/Env-v0")).ok
"""

from pbcs_ompl.resettable import check_resettable
from pbcs_ompl.testing.solve_rate import SolveRate, assert_solves

__all__ = ["SolveRate", "assert_solves", "check_resettable"]
