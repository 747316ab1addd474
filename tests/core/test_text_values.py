"""JSON and TOML of unknown origin: what Python takes is taken, within bounds; all else is one ValueError."""

import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.text_values import DEEPEST, parse_json, parse_toml

VALUES = st.recursive(st.none() | st.booleans() | st.integers(-10**200, 10**200) | st.floats(allow_nan=False,
                      allow_infinity=False) | st.text(st.characters(exclude_categories=["Cs"])),
                      lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(st.characters(
                          exclude_categories=["Cs"])), inner, max_size=3), max_leaves=10)


@given(VALUES)
def test_json_round_trip(value: object) -> None:
    assert parse_json(json.dumps(value)) == value


@given(st.text() | st.binary().map(lambda content: content.decode("latin-1")))
def test_any_text_is_values_or_one_error(text: str) -> None:
    for parse in (parse_json, parse_toml):
        with suppress(ValueError):
            parse(text)


@pytest.mark.parametrize(("text", "message"), [
    ("[" * 100_000, "levels deep"), ('{"a":' * 5_000, "levels deep"), ("[" * 70 + "]" * 70, f"{DEEPEST} levels deep"),
    ('{"a": 1, "b": 2, "a": 3}', "the key 'a' is there twice"), ("1e400", "too large"), ("1" * 301, "301 digits"),
    ('{"rows": [1, {"p": NaN}]}', r"rows\[1\].p is nan; expected a finite number"), ("[-Infinity]", "is -inf"),
    ('{"a": "\\ud800"}', "half a surrogate pair"), ("{", "Expecting"),
])
def test_json_that_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_json(text)


@pytest.mark.parametrize(("text", "message"), [
    ("a = " + "[" * 100_000, "levels deep"), (".".join("a" * 100) + " = 1", "levels deep"),
    ("a = 1\na = 2", "overwrite"),
    ("a = 0x" + "f" * 4_000, "300 digits"),
])
def test_toml_that_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_toml(text)
