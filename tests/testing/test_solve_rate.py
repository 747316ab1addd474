"""A test can demand a solve rate; a failure says why it was not reached."""

import pytest

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.testing import assert_solves
from pbcs_ompl.testing.plugin import rate_table

MAZE = ("pbcs/Maze-v0", {"size": 2})


def test_a_reached_rate_is_returned():
    rate = assert_solves("Ex", *MAZE, seeds=4, max_transitions=20_000)
    assert rate.solved == len(rate.seeds) == 4
    assert "solved 4 of 4 seeds" in str(rate)


def test_a_missed_rate_fails_with_a_line_for_each_seed():
    with pytest.raises(AssertionError, match="expected at least 3 solved") as failed:
        assert_solves("Ex", *MAZE, seeds=[3, 5, 8], max_transitions=20)
    lines = str(failed.value).splitlines()
    assert [line.split()[0] for line in lines[-3:]] == ["3", "5", "8"]
    assert all("the budget ended" in line for line in lines[-3:])


def test_wrong_arguments_are_not_failures_of_the_planner():
    with pytest.raises(UnknownName, match="did you mean 'Ex'"):
        assert_solves("Exx", *MAZE, seeds=2, max_transitions=100)
    with pytest.raises(InvalidOption, match="at_least = 5 of 2"):
        assert_solves("Ex", *MAZE, seeds=2, at_least=5, max_transitions=100)


def test_the_plugin_serves_tests_outside_of_this_project(pytester):
    pytester.makepyfile("""
        def test_mine(solve_rate):
            solve_rate("Ex", "pbcs/Maze-v0", {"size": 2}, seeds=3, max_transitions=20_000)

        def test_too_much(solve_rate):
            solve_rate("Rides", "pbcs/Maze-v0", {"size": 2}, seeds=3, max_transitions=10)
    """)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*expected at least 3 solved*", "*solve rates, with 95 % Wilson intervals*",
                                 "Ex *3/3 [[]44%, 100%[]]*", "Rides *0/3 [[]0%, 56%[]]*"])
    assert "solve_rate.py" not in result.stdout.str()  # the traceback ends in the user's test


def test_the_table_has_a_row_for_everybody_and_a_column_for_every_place():
    lines = rate_table([["b", "10x10", 1, 2], ["a", "2x2", 2, 2], ["b", "2x2", 0, 2]])
    assert lines[0].split() == ["2x2", "10x10"]
    assert [line.split()[0] for line in lines[1:]] == ["a", "b"]
    assert lines[2].split()[1] == "0/2"
