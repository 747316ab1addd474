"""Ex in its three gears: compiled, batch 1 and growing batches."""

import numpy as np
import pytest
from ompl import base as ob

from pbcs_ompl.core.errors import CallbackFailed, InvalidOption
from pbcs_ompl.planners import Ex

EXACT, TIMEOUT = ob.PlannerStatus.EXACT_SOLUTION, ob.PlannerStatus.TIMEOUT


def plain_alg_5(model, seed, budget):
    """Return states, parents and controls of Alg. 5 as lists, from the same random numbers."""
    from importlib.util import module_from_spec, spec_from_file_location
    from pathlib import Path

    from pbcs_ompl.core.seeding import SeedTree

    spec = spec_from_file_location("transcription", Path(__file__).with_name("test_bin_queue.py"))
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    rng, alg = SeedTree(seed).child("strategy").generator(), module.Algorithm5()
    states, parents, controls = [model.initial_state()], [-1], [np.zeros(2)]
    alg.insert(tuple(np.floor(states[0] / model.bin_size)), 0)
    for new in range(1, budget + 1):
        node = alg.select(rng.random(), rng.random())
        control = model.action_low + (model.action_high - model.action_low) * rng.random(2)
        result = model.transition(states[node][None], control[None])
        states.append(result.states[0])
        parents.append(node)
        controls.append(control)
        if result.success[0]:
            break
        if not result.terminated[0]:
            alg.insert(tuple(np.floor(states[new] / model.bin_size)), new)
    return np.array(states), np.array(parents), np.array(controls)


@pytest.mark.parametrize("seed", range(4))
def test_batch_1_and_compiled_are_alg_5_to_the_last_bit(solve, square, compiled_square, seed):
    states, parents, controls = plain_alg_5(square(), seed, 5000)
    gears = ((square(), {"batch": 1}), (compiled_square(), {}), (compiled_square(), {"batch": 1}))
    for model, options in gears:
        planner, status, counter, _ = solve(lambda si, o=options: Ex.build(si, seed=seed, **o), model)
        assert planner.error is None
        assert status == EXACT
        assert counter.count == len(parents) - 1
        assert np.array_equal(planner.tree.states, states)
        assert np.array_equal(planner.tree.parents, parents)
        assert np.array_equal(planner.tree.controls, controls)


def test_budget_and_second_solve_go_on_with_the_same_tree(solve, compiled_square):
    """In slices of the budget, the compiled loop makes the tree that it makes at once."""
    model = compiled_square(goal=9.0)
    whole, status, counter, _ = solve(lambda si: Ex.build(si), model, 70_000)
    assert status == TIMEOUT
    assert counter.count == 70_000 == len(whole.tree) - 1
    parts, _, counter, _ = solve(lambda si: Ex.build(si), model, 2048)
    for budget in (4096, 40_960, 70_000):
        counter.budget = budget
        parts.solve(ob.PlannerTerminationCondition(lambda: False))
    assert np.array_equal(parts.tree.states, whole.tree.states)


def test_growing_batches_cost_few_more_transitions(solve, square, compiled_square):
    """A batch per tie finds the goal with about the transitions of Alg. 5, in far fewer calls."""
    alone, batched = (np.median([solve(lambda si, s=seed: Ex.build(si, seed=s), model(), 20_000)[2].count
                                 for seed in range(30)]) for model in (compiled_square, square))
    assert batched < 1.6 * alone


@pytest.mark.parametrize("portion", [2, 8])
def test_batches_come_in_portions_that_keep_all_cores_busy(solve, square, portion):
    model, sizes = square(goal=9.0), []
    transition = model.transition

    def counted(states, controls):
        sizes.append(len(states))
        return transition(states, controls)

    model.parallel_batch, model.transition = portion, counted
    planner, _, counter, _ = solve(lambda si: Ex.build(si), model, 4001)
    assert planner.error is None
    assert counter.count == sum(sizes) == 4001
    assert sizes[-1] % portion == 1  # the rest of the budget
    assert min(sizes[:-1]) == portion
    assert not any(size % portion for size in sizes[:-1])


def test_terminal_states_are_never_expanded(solve, square):
    class Deadly(square):
        def transition(self, states, controls):
            result = super().transition(states, controls)
            dead = result.states[:, 0] > 1.0
            return result._replace(terminated=dead, success=np.zeros_like(dead))

    planner, status, _, _ = solve(lambda si: Ex.build(si), Deadly(), 4000)
    tree = planner.tree
    assert status == TIMEOUT
    assert tree.terminal.any()
    assert not tree.terminal[tree.parents[1:]].any()


def test_bin_size_is_an_option(solve, compiled_square):
    small, large = (solve(lambda si, b=size: Ex.build(si, bin_size=b), compiled_square(goal=9.0), 3000)[0].strategy
                    for size in (0.1, [1.0, 3.0]))
    assert small.queue.num_bins > 200
    assert large.queue.num_bins == 3


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), [[1.0]], "large"])
def test_bad_bin_sizes_are_refused(make_setup, square, size):
    with pytest.raises(InvalidOption, match="bin_size"):
        Ex.build(make_setup(square()).getSpaceInformation(), bin_size=size)


def test_bin_size_of_another_dimension_is_refused(solve, square):
    planner, _, _, _ = solve(lambda si: Ex.build(si, bin_size=[1.0, 1.0, 1.0]), square())
    assert isinstance(planner.error, InvalidOption)


def test_nan_in_the_compiled_step_names_the_transition(solve, compiled_square):
    model = compiled_square()
    step = model.compiled_step()
    model.compiled_step = lambda: (step[0], np.array([np.inf, 2.7, 0.3, 1.0]), *step[2:])
    model.action_low, model.action_high = np.full(2, -1e308), np.full(2, 1e308)  # their difference overflows
    planner, _, _, _ = solve(lambda si: Ex.build(si), model)
    assert isinstance(planner.error, CallbackFailed)
    assert "expected finite numbers" in str(planner.error)


def test_memory_of_a_node(solve, compiled_square):
    planner, _, _, _ = solve(lambda si: Ex.build(si, bin_size=0.1), compiled_square(goal=9.0), 300_000)
    assert (planner.tree.nbytes + planner.strategy.nbytes) / len(planner.tree) < 65
