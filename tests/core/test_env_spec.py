"""The task as one object: different tasks have different names, values come back from files."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.env_spec import EnvSpec

ENTRY = st.none() | st.booleans() | st.integers(-5, 5) | st.text(alphabet='a1,= "%[]n', max_size=4)
OPTIONS = st.dictionaries(st.sampled_from(["a", "b"]), st.recursive(
    ENTRY, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("xy"), inner, max_size=2),
    max_leaves=5))


@given(OPTIONS, OPTIONS)
def test_different_options_have_different_names(one: dict[str, Any], other: dict[str, Any]) -> None:
    first, second = EnvSpec("E-v0", one), EnvSpec("E-v0", other)
    if not first.same_as(second):
        assert first.label != second.label


@pytest.mark.parametrize(("one", "other"), [
    ({"layout": ["| |   |"]}, {"layout": ["|   | |"]}), ({"a": "1"}, {"a": 1}), ({"a": "x,b=1"}, {"a": "x", "b": 1}),
    ({"a": None}, {}), ({"a": " x"}, {"a": "x"}),
])
def test_names_keep_what_differs(one: dict[str, Any], other: dict[str, Any]) -> None:
    assert EnvSpec("E-v0", one).label != EnvSpec("E-v0", other).label


def test_names_are_short_where_they_can_be() -> None:
    assert EnvSpec("E-v0").label == "E-v0"
    assert EnvSpec("E-v0", {"size": 7, "mode": "fast"}, "reward>0").label == "E-v0(size=7,mode=fast,goal=reward>0)"


@given(OPTIONS)
def test_a_spec_comes_back_from_its_plain_values(options: dict[str, Any]) -> None:
    spec = EnvSpec("E-v0", options, reset_options=options or None)
    again = EnvSpec.from_dict(spec.to_dict())
    assert again.kwargs == options
    assert again.reset_options == (options or None)
    assert again.same_as(spec)
