"""From a planner's name, class or factory to an OMPL planner on a problem."""

import inspect
from collections.abc import Callable, Collection
from typing import Any

from ompl import base as ob

from pbcs_ompl.core import registry
from pbcs_ompl.core.errors import InvalidOption, PbcsError, did_you_mean
from pbcs_ompl.core.interfaces import PlannerFactory

Recipe = Callable[..., Any]


class PlannerSpec:
    """What builds a planner: a registered name, `module:attribute`, an `ompl.base.Planner` class, a factory.

    A planner class or `build` that has a parameter `seed` is given one.

    Args:
        planner: What names or is the planner.
        options: Its options. Their names are checked here, before anything runs, unless `build` takes any
            (**options) and checks them itself.

    Raises:
        UnknownName: no planner has this name.
        InvalidOption: the planner has no such option, or `planner` is nothing that builds a planner.
    """

    def __init__(self, planner: Any, options: dict[str, Any]):
        source = registry.load("planner", planner) if isinstance(planner, str) else planner
        self.name = planner if isinstance(planner, str) else _name_of(planner)
        self.options = dict(options)
        self._recipe = _recipe(self.name, source)
        self._parameters = _parameters(self._recipe)
        if not any(p.kind is inspect.Parameter.VAR_KEYWORD for p in self._parameters.values()):
            known = [name for name in list(self._parameters)[1:] if name != "seed"]  # the first: the problem
            _check_names(self.name, self.options, known)

    def build(self, space_information: Any, seed: int) -> Any:
        """Return the planner.

        Raises:
            InvalidOption: the planner refused the value of an option.
        """
        seeds = {"seed": seed} if "seed" in self._parameters else {}
        try:
            return self._recipe(space_information, **seeds, **self.options)
        except PbcsError:
            raise
        except (TypeError, ValueError) as error:
            raise InvalidOption(f"planner {self.name!r} refused options {self.options}: {error}") from error


def _recipe(name: str, source: Any) -> Recipe:
    if isinstance(source, PlannerFactory):
        return source.build
    if inspect.isclass(source) and issubclass(source, ob.Planner):
        return source
    raise InvalidOption(f"{name!r} is no planner: expected a registered name, module:attribute, a subclass "
                        "of ompl.base.Planner, or something with build(si, *, seed, **options)")


def _name_of(source: Any) -> str:
    return source.__name__ if inspect.isclass(source) else type(source).__name__


def _parameters(recipe: Recipe) -> dict[str, inspect.Parameter]:
    """Return the parameters of a callable; none for OMPL's own classes, which take only the problem."""
    try:
        return dict(inspect.signature(recipe).parameters)
    except ValueError:
        return {}


def _check_names(planner: str, options: Collection[str], known: Collection[str]) -> None:
    for option in options:
        if option not in known:
            hint = did_you_mean(option, known) or "; it takes no options"
            raise InvalidOption(f"planner {planner!r} has no option {option!r}{hint}")
