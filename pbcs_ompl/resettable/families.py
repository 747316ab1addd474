"""Choose how an environment is restored that offers no way of its own, and prove it by branching."""

import warnings
from typing import Any, TypeVar

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.resettable.adapters.classic import AttributeEnv, has_state_attribute
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.visited import CopiedEnv, FreshEnv, ReplayedEnv, copies_are_faithful, replays
from pbcs_ompl.resettable.branching import first_difference, fresh_difference, repeats
from pbcs_ompl.resettable.simulation import simulation_of
from pbcs_ompl.resettable.supported import TaskMaker
from pbcs_ompl.resettable.task_env import bare

HOW_TO = (
    "implement `get_env_state() -> array [D]` and `set_env_state(array)` beside `step` (simple), or the "
    "protocol `pbcs_ompl.core.interfaces.VectorisedEnv` (fast)"
)
Provable = TypeVar("Provable")


def restorable(inner: Any, goal: Any, feature: Any, make_inner: TaskMaker | None) -> RestorableEnv:
    """Return an environment as its family restores it.

    MuJoCo, classic control, deep copies, replayed actions, and these in fresh instances: the first that fits, and whose
    restored states continue as fresh instances do.

    Args:
        inner: The environment without wrappers.
        goal, feature: Rules; see `RestorableEnv`.
        make_inner: Makes fresh instances; None where none can be made, and nothing is proved.

    Raises:
        NotResettable: none does; says what differs.
    """
    if simulation_of(inner) is not None:
        return proved(MujocoEnv(inner, goal, feature), make_inner)
    if has_state_attribute(inner):
        return proved(AttributeEnv(inner, goal, feature), make_inner)
    if replays(inner):
        apart = inner if make_inner is None else make_inner()  # the copies of some physics servers close the original
        if copies_are_faithful(apart) and not _difference(env := CopiedEnv(inner, goal, feature), make_inner):
            return env
        if not _difference(replayed := ReplayedEnv(inner, goal, feature), make_inner):
            _warn(f"{_name(inner)} is restored by replaying its actions, which is slow: {HOW_TO}")
            return replayed
    if make_inner is None:
        raise NotResettable(f"{_name(inner)} is not resettable: the same actions from the same seed lead elsewhere in "
                            f"an instance that has run before, and no fresh one can be made; {HOW_TO}")
    return _fresh(inner, goal, feature, make_inner)


def proved(env: Provable, make_inner: TaskMaker | None) -> Provable:
    """Return `env`, if its restored states continue as fresh instances do.

    Args:
        env: An environment with `get_env_state` and `set_env_state`, adapted or an author's own.
        make_inner: Makes fresh instances; None to prove nothing.

    Raises:
        NotResettable: says what differs first, or that steps are random.
    """
    found = _difference(env, make_inner)
    if not found:
        return env
    assert make_inner is not None
    if isinstance(env, RestorableEnv):
        env.check_constants()
    inner: Any = getattr(env, "inner", env)
    _refuse_random(env, inner, make_inner)
    raise NotResettable(f"{_name(inner)} is not resettable: a restored state does not continue as a fresh instance "
                        f"does; it differs in {found}; {HOW_TO}")


def _fresh(inner: Any, goal: Any, feature: Any, make_inner: TaskMaker) -> RestorableEnv:
    env = FreshEnv(inner, goal, feature, make_inner=make_inner)
    _refuse_random(env, inner, make_inner)
    if found := first_difference(env, make_inner):
        raise NotResettable(f"{_name(inner)} is not resettable: replayed in a fresh instance, it differs in {found}; "
                            f"{HOW_TO}")
    _warn(f"{_name(inner)} does not do the same after a reset as a fresh instance does; it is restored by making a "
          f"fresh instance and replaying its actions, which is slow: {HOW_TO}")
    return env


def _difference(env: Any, make_inner: TaskMaker | None) -> str:
    return "" if make_inner is None else first_difference(env, make_inner)


def _refuse_random(env: Any, inner: Any, make_inner: TaskMaker) -> None:
    """Refuse an environment of which two fresh instances that do the same differ.

    Raises:
        NotResettable: says where, and whether steps or the making of it are random.
    """
    found = fresh_difference(env, make_inner)
    if not found:
        return
    if repeats(env, make_inner):
        raise NotResettable(f"{_name(inner)} is not resettable: each instance of it is another environment, as if its "
                            f"constructor drew random numbers: with the same seed and actions, fresh instances differ "
                            f"in {found}; draw them in reset, or give the constructor a seed")
    what = "resets" if found.endswith("at step 0") else "steps"
    raise NotResettable(f"{_name(inner)} is not resettable: the same actions from the same seed lead elsewhere, so its "
                        f"{what} are random, or depend on what is outside of it: fresh instances differ in {found}; "
                        f"draw from self.np_random in reset, or make the randomness part of its state")


def _warn(text: str) -> None:
    warnings.warn(text, stacklevel=7)


def _name(env: Any) -> str:
    return env.spec.id if getattr(env, "spec", None) is not None else type(bare(env)).__name__
