"""How many seeds a planner solves, as something a test can demand."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.core.errors import InvalidOption, PbcsError
from pbcs_ompl.core.statistics import wilson


@dataclass(frozen=True)
class SolveRate:
    """The runs of one planner in one environment.

    Attributes:
        planner, env: Their names, the latter with its options.
        seeds: The seeds that were run.
        results: For each seed the answer, or the error that ended it.
    """

    planner: str
    env: str
    seeds: tuple[int, ...]
    results: tuple[PlanResult | PbcsError, ...]

    @property
    def solved(self) -> int:
        """Seeds with a solution that replays exactly."""
        return sum(isinstance(result, PlanResult) and result.solved and bool(result.replay_ok)
                   for result in self.results)

    def __str__(self) -> str:
        low, high = wilson(self.solved, len(self.seeds))
        lines = [f"{self.planner} in {self.env}: solved {self.solved} of {len(self.seeds)} seeds "
                 f"(95 % interval {low:.0%} to {high:.0%})", f"{'seed':>6}  {'solved':<8}{'transitions':>12}  why"]
        return "\n".join(lines + [_line(seed, result) for seed, result in zip(self.seeds, self.results, strict=True)])


class TooFewSolved(AssertionError):
    """A planner solves fewer seeds than a test demands.

    Args:
        rate: What it solves.
        wanted: How many were demanded.
    """

    def __init__(self, rate: SolveRate, wanted: int):
        super().__init__(f"expected at least {wanted} solved\n{rate}")
        self.rate = rate


def _line(seed: int, result: PlanResult | PbcsError) -> str:
    if isinstance(result, PbcsError):
        return f"{seed:>6}  {'error':<8}{'':>12}  {result}"
    why = "" if result.solved else "the budget ended"
    if result.solved and not result.replay_ok:
        why = "the path does not replay"
    return f"{seed:>6}  {'yes' if result.solved else 'no':<8}{result.transitions:>12,}  {why}"


def assert_solves(planner: Any, env: str, env_kwargs: dict[str, Any] | None = None, *,
                  planner_kwargs: dict[str, Any] | None = None, seeds: int | Sequence[int] = 20,
                  at_least: int | None = None, max_transitions: int) -> SolveRate:
    """Run `planner` once for each seed; fail with a table when too few runs are solved.

    A run counts when its path reaches the goal within `max_transitions` and replays bit for bit in a fresh environment.
    An error of the planner counts as not solved; an error in the arguments is raised at once.

    Args:
        planner, env, env_kwargs, planner_kwargs, max_transitions: As in `pbcs_ompl.plan`.
        seeds: How many seeds (0, 1, ...), or the seeds.
        at_least: How many have to be solved; all by default.

    Raises:
        TooFewSolved: an AssertionError; the message holds a line for each seed.
    """
    __tracebackhide__ = True  # pytest shows the user's line
    chosen = tuple(range(seeds)) if isinstance(seeds, int) else tuple(seeds)
    wanted = len(chosen) if at_least is None else at_least
    if not chosen or not 0 <= wanted <= len(chosen):
        raise InvalidOption(f"at_least = {wanted} of {len(chosen)} seeds; expected 0 to {len(chosen)}, and one seed")
    results: list[PlanResult | PbcsError] = []
    for seed in chosen:
        try:
            results.append(plan(env, planner, env_kwargs=env_kwargs, planner_kwargs=planner_kwargs, seed=seed,
                                max_transitions=max_transitions))
        except PbcsError as error:
            if not results:
                raise
            results.append(error)
    name = planner if isinstance(planner, str) else getattr(planner, "__name__", type(planner).__name__)
    rate = SolveRate(name, f"{env} {env_kwargs or {}}", chosen, tuple(results))
    if rate.solved < wanted:
        raise TooFewSolved(rate, wanted)
    return rate
