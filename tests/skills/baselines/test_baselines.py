"""The laws of the baselines: the regulator is Riccati's, the mean of sequences is the best one at temperature 0."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import pbcs_ompl
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable.judge import Judge
from pbcs_ompl.skills.baselines import (
    LQRController,
    LQRSettings,
    MPPIController,
    MPPISettings,
    OpenLoop,
    evaluate_privileged,
    train_reverse_curriculum,
)
from pbcs_ompl.skills.baselines.deviation import Deviation
from pbcs_ompl.skills.baselines.lqr import LinearModels, linear_models, riccati
from pbcs_ompl.skills.baselines.mppi import weighted_mean


@pytest.fixture(scope="module")
def plan() -> Trajectory:
    found = pbcs_ompl.plan("pbcs/Maze-v0", "Rides", env_kwargs={"size": 3}, seed=600)
    assert found.trajectory is not None
    return found.trajectory


def model_of(plan: Trajectory):
    return pbcs_ompl.make(plan.environment)


def test_the_first_gain_of_a_long_plan_is_that_of_the_algebraic_equation() -> None:
    rng = np.random.default_rng(0)
    a, b = np.eye(4) + 0.2 * rng.standard_normal((4, 4)), rng.standard_normal((4, 2))
    q, r = np.diag([1.0, 2.0, 0.5, 1.0]), np.diag([0.1, 0.3])
    models = LinearModels(np.tile(a, (200, 1, 1)), np.tile(b, (200, 1, 1)))
    gains = riccati(models, q, r, 10.0 * np.eye(4))
    s = solve_discrete_are(a, b, q, r)
    np.testing.assert_allclose(gains[0], np.linalg.solve(r + b.T @ s @ b, b.T @ s @ a), atol=1e-8)
    assert np.abs(gains[-1] - gains[0]).max() > 1e-3  # the end is not stationary


def test_the_gains_are_optimal_for_a_short_plan() -> None:
    """Against the minimum of the quadratic in all controls at once."""
    rng = np.random.default_rng(1)
    steps, q, r, final = 4, np.eye(2), 0.1 * np.eye(1), 5.0 * np.eye(2)
    models = LinearModels(rng.standard_normal((steps, 2, 2)), rng.standard_normal((steps, 2, 1)))
    start, cost, controls = np.array([1.0, -2.0]), np.zeros((steps, steps)), np.zeros(steps)
    states, effects = [start], [np.zeros((2, steps))]
    for t in range(steps):
        effects.append(models.A[t] @ effects[-1] + models.B[t] @ np.eye(steps)[t:t + 1])
        states.append(models.A[t] @ states[-1])
    for t, (free, effect) in enumerate(zip(states, effects, strict=True)):
        weight = final if t == steps else q
        cost += effect.T @ weight @ effect
        controls -= effect.T @ weight @ free
    best = np.linalg.solve(cost + r[0, 0] * np.eye(steps), controls)
    state = start
    for t, gain in enumerate(riccati(models, q, r, final)):
        control = -gain @ state
        assert control[0] == pytest.approx(best[t])
        state = models.A[t] @ state + models.B[t] @ control


def test_linear_models_of_free_space_are_its_own(plan: Trajectory) -> None:
    """In a box without walls nearby, s' = s + a: A is the identity, B the step in deviations for a half-width."""
    model = pbcs_ompl.make("pbcs/Box-v0", {"goal": [4.0, 2.5]})
    controls = np.tile([[0.05, 0.0]], (12, 1))
    states = np.array([2.5, 2.5]) + np.concatenate([np.zeros((1, 2)), controls.cumsum(axis=0)])
    deviation, counter = Deviation.along(states), Counter()
    models = linear_models(model, states, controls, deviation, LQRSettings(rollouts=30, depth=3),
                           np.random.default_rng(0), counter)
    np.testing.assert_allclose(models.A[5:], np.tile(np.eye(2), (7, 1, 1)), atol=0.05)
    np.testing.assert_allclose(models.B[5:], np.tile(np.diag(0.1 / deviation.scale), (7, 1, 1)), rtol=0.05, atol=0.05)
    assert counter.count == 30 * (10 * 3 + 2 + 1)


def test_a_plan_may_be_shorter_than_the_rollouts() -> None:
    model = pbcs_ompl.make("pbcs/Box-v0", {"goal": [4.0, 2.5]})
    states, counter = np.array([[2.5, 2.5], [2.55, 2.5], [2.6, 2.5]]), Counter()
    models = linear_models(model, states, np.tile([[0.05, 0.0]], (2, 1)), Deviation.along(states),
                           LQRSettings(rollouts=8, depth=10), np.random.default_rng(0), counter)
    assert (models.A.shape, models.B.shape, counter.count) == ((2, 2, 2), (2, 2, 2), 8 * (2 + 1))


def test_deviations_of_angles_go_the_short_way_round() -> None:
    observations = np.array([[3.0, 0.0], [-3.0, 1.0], [-2.9, 9.0], [-2.8, 1.0]])
    deviation = Deviation.along(observations)
    assert deviation.angles.tolist() == [True, False]  # the other jumps, but is not within [-pi, pi]
    difference = deviation(observations[0], observations[1]) * deviation.scale
    np.testing.assert_allclose(difference, [6.0 - 2 * np.pi, -1.0])


def test_open_loop_executes_the_plan_and_then_its_last_action(plan: Trajectory) -> None:
    (execution,) = Judge.of(model_of(plan)).drive(OpenLoop(plan.actions), reset_seeds=[plan.reset_seed], max_steps=1000)
    assert (execution.success, execution.steps) == (True, plan.length)
    controller = OpenLoop(plan.actions[:2])
    controller.reset(3)
    seen = [controller.act(np.zeros((3, 2))) for _ in range(4)]
    for step, actions in enumerate(seen):
        np.testing.assert_array_equal(actions, np.tile(plan.actions[min(step, 1)], (3, 1)))


def test_the_regulator_executes_the_plan_and_corrects_noise(plan: Trajectory) -> None:
    model, counter = model_of(plan), Counter()
    controller = LQRController.along(model, plan, counter=counter)
    judge, seeds = Judge.of(model), [plan.reset_seed] * 40
    (nominal,) = judge.drive(controller, reset_seeds=seeds[:1], max_steps=plan.length + 1)
    assert nominal.success
    noisy = [judge.drive(one, reset_seeds=seeds, max_steps=2 * plan.length, epsilon=0.1)
             for one in (OpenLoop(plan.actions), controller)]
    open_loop, regulated = (sum(execution.success for execution in found) for found in noisy)
    assert regulated >= 36 > open_loop
    assert counter.count > 0


def test_the_mean_at_temperature_0_is_the_best_sequence() -> None:
    rng = np.random.default_rng(2)
    controls, costs = rng.standard_normal((50, 6, 2)), rng.uniform(0.0, 9.0, 50)
    best = controls[costs.argmin()]
    np.testing.assert_array_equal(weighted_mean(controls, costs, 0.0), best)
    np.testing.assert_allclose(weighted_mean(controls, costs, 1e-6), best)
    np.testing.assert_allclose(weighted_mean(controls, costs, 1e9), controls.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(weighted_mean(controls, costs + 7.0, 0.3), weighted_mean(controls, costs, 0.3))


def test_predictive_control_drives_through_noise_and_counts_its_simulator(plan: Trajectory) -> None:
    model, counter = model_of(plan), Counter()
    settings = MPPISettings(samples=32, horizon=10)
    found = evaluate_privileged(lambda read: MPPIController(model, plan, read, settings, counter=counter),
                                plan.environment, reset_seed=plan.reset_seed, max_steps=2 * plan.length, episodes=3,
                                epsilon=0.1)
    assert found.successes == 3
    assert counter.count >= 3 * 32 * plan.length / 2
    again = evaluate_privileged(lambda read: MPPIController(model, plan, read, settings), plan.environment,
                                reset_seed=plan.reset_seed, max_steps=2 * plan.length, episodes=3, epsilon=0.1)
    assert again == found


def test_predictive_control_drives_one_episode_at_a_time(plan: Trajectory) -> None:
    with pytest.raises(InvalidOption, match="one state at a time"):
        MPPIController(model_of(plan), plan, lambda: plan.states[0]).reset(2)


@pytest.mark.slow
def test_the_reverse_curriculum_moves_back_and_solves_a_short_plan() -> None:
    found = pbcs_ompl.plan("pbcs/Box-v0", "Rides", env_kwargs={"goal": [3.2, 2.5]}, seed=1)
    assert found.trajectory is not None
    model = pbcs_ompl.make(found.trajectory.environment)
    method = train_reverse_curriculum(model, found.trajectory, seed=0, max_transitions=6000)
    assert method.covered > 0.0
    assert method.trainer.counter.count <= 6000
    assert method.trainer.updates > 0
    controller = method.chain(50).controller()
    controller.reset(2)
    assert controller.act(np.array([[2.5, 2.5], [2.6, 2.4]])).shape == (2, 2)
