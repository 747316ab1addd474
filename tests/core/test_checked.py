"""A function that is checked gets arguments of its annotations, or is not called."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.checked import check_fields, checked, fits
from pbcs_ompl.core.errors import InvalidOption


@checked
def called(count: int, *, share: float = 0.5, name: str | None = None, kind: Literal["a", "b"] = "a",
           options: dict[str, Any] | None = None, names: Sequence[str] = (), call: Callable[[], None] | None = None,
           out: str | Path | None = None, flag: bool = False) -> int:
    return count


@pytest.mark.parametrize("given", [
    {"share": 1}, {"share": np.float32(1)}, {"name": "x"}, {"kind": "b"}, {"options": {"a": [1]}}, {"names": ["x"]},
    {"names": ("x",)}, {"call": print}, {"out": Path("x")}, {"flag": np.True_}, {"count": np.int64(3)}])
def test_what_fits_is_passed_on(given):
    assert called(**{"count": 3, **given}) == 3


@pytest.mark.parametrize(("given", "message"), [
    ({"count": True}, "count is True; expected int"),
    ({"count": 1.0}, "count is 1.0; expected int"),
    ({"share": "x"}, "share is 'x'; expected float"),
    ({"name": b"x"}, "name is b'x'; expected str or None"),
    ({"kind": "c"}, "kind is 'c'; expected 'a' or 'b'"),
    ({"options": {1: 2}}, "options is {1: 2}; expected dict of str to anything or None"),
    ({"names": "x"}, "names is 'x'; expected Sequence of str"),
    ({"names": [1]}, "names is [1]; expected Sequence of str"),
    ({"call": 5}, "call is 5; expected a function or None"),
    ({"flag": 1}, "flag is 1; expected bool"),
])
def test_what_does_not_fit_is_named(given, message):
    with pytest.raises(InvalidOption) as caught:
        called(**{"count": 3, **given})
    assert str(caught.value) == message


def test_a_value_that_cannot_be_shown_is_named_by_its_type():
    class Silent:
        def __repr__(self):
            raise RuntimeError

    with pytest.raises(InvalidOption, match=r"count is .*Silent"):
        called(Silent())


def test_wrong_names_and_numbers_of_arguments_stay_type_errors():
    with pytest.raises(TypeError, match="no_such"):
        called(3, no_such=1)


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
                    lambda one: st.lists(one) | st.dictionaries(st.text(), one)))
def test_every_value_has_one_of_the_types_of_json(value):
    assert sum([fits(value, None), fits(value, bool), fits(value, str), fits(value, float), fits(value, list[Any]),
                fits(value, Mapping[str, Any])]) == 1


@dataclass
class Point:
    x: float
    label: str | None = None


def test_fields_of_a_dataclass():
    check_fields(Point(1, "x"))
    with pytest.raises(InvalidOption, match="x is '1'; expected float"):
        check_fields(Point("1"))
