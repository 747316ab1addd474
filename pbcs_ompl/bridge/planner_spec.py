"""From a planner's name, class or factory to an OMPL planner on a problem."""

import inspect
from collections.abc import Callable
from typing import Any

from ompl import base as ob

from pbcs_ompl.core import registry
from pbcs_ompl.core.callbacks import callback_failed, code_of_others, describe
from pbcs_ompl.core.errors import InvalidOption, PbcsError
from pbcs_ompl.core.interfaces import AnytimePlanner, BatchPlanner, PlannerFactory
from pbcs_ompl.core.options import check_names


class PlannerSpec:
    """A planner and its options, in one of three forms.

    1. A registered name, or `module:attribute`, of one of the other two.
    2. A subclass of `ompl.base.Planner`, built as `cls(si, **options)`.
    3. A `PlannerFactory`: an object with `options()` and `build(si, *, seed, **options)`, such as a strategy class.

    A planner class whose constructor has a parameter `seed` is given one.

    Args:
        planner: The planner.
        options: Its options. Their names are checked here, before anything runs, unless the constructor takes any
            (**options) and checks them itself.

    Raises:
        UnknownName: no planner has this name.
        InvalidOption: the planner has no such option, or `planner` has none of the three forms.
    """

    def __init__(self, planner: Any, options: dict[str, Any]):
        source = registry.load("planner", planner) if isinstance(planner, str) else planner
        self.name = planner if isinstance(planner, str) else _name_of(planner)
        self.options = dict(options)
        with code_of_others(f"the planner {self.name!r}"):
            self._read(source, options)

    def _read(self, source: Any, options: dict[str, Any]) -> None:
        if isinstance(source, PlannerFactory):
            self._build: Callable[..., Any] = source.build
            self._seeded, self._defaults = True, source.options()
            check_names(f"planner {self.name!r}", "option", options, self._defaults)
        elif inspect.isclass(source) and issubclass(source, ob.Planner):
            parameters = _parameters(source)
            self._build, self._seeded = source, "seed" in parameters
            self._defaults = {name: None if parameter.default is parameter.empty else parameter.default
                              for name, parameter in parameters.items()
                              if name != "seed" and parameter.kind is not parameter.VAR_KEYWORD}
            if not any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
                check_names(f"planner {self.name!r}", "option", options, self._defaults)
        else:
            raise InvalidOption(
                f"{self.name!r} is no planner: expected a registered name, module:attribute, a subclass of "
                "ompl.base.Planner, or a factory with options() and build(si, *, seed, **options), such as a strategy "
                "class")

    def build(self, space_information: Any, seed: int) -> Any:
        """Return the planner.

        Raises:
            InvalidOption: the planner refused the value of an option.
        """
        seeds = {"seed": seed} if self._seeded else {}
        try:
            return self._build(space_information, **seeds, **self.options)
        except PbcsError:
            raise
        except (TypeError, ValueError) as error:
            raise InvalidOption(f"planner {self.name!r} refused options {self.options}: {describe(error)}") from error
        except (Exception, SystemExit) as error:
            raise callback_failed(error, f"the planner {self.name!r}") from error

    @property
    def defaults(self) -> dict[str, Any]:
        """Every option with its default; None where OMPL, the problem or nothing decides it."""
        return dict(self._defaults)

    def settings(self, planner: Any) -> dict[str, Any]:
        """Return every option with the value in use, once `planner`, which this spec built, has solved.

        Options that OMPL or the planner decides about and does not report are left out.
        """
        ours = as_batch_planner(planner)
        values = {**self._defaults, **self.options} if ours is None else ours.settings
        return {name: value for name, value in values.items() if value is not None}


def as_batch_planner(planner: Any) -> BatchPlanner | None:
    """Return an OMPL planner if it can propagate batches, else None."""
    return planner if isinstance(planner, BatchPlanner) else None


def as_anytime_planner(planner: Any) -> AnytimePlanner | None:
    """Return an OMPL planner if it says when it found which solutions, else None."""
    return planner if isinstance(planner, AnytimePlanner) else None


def _name_of(source: Any) -> str:
    return source.__name__ if inspect.isclass(source) else type(source).__name__


def _parameters(planner: type) -> dict[str, inspect.Parameter]:
    """Return the parameters of a constructor behind the problem; none for OMPL's own, which take only that."""
    try:
        return dict(list(inspect.signature(planner).parameters.items())[1:])
    except ValueError:
        return {}
