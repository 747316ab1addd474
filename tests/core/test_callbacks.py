"""Whatever the code of others raises becomes one line; our own errors and Ctrl-C pass."""

import pytest

from pbcs_ompl.core.callbacks import code_of_others, describe
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption


class Speechless(Exception):
    def __str__(self):
        raise ValueError("no words")

    __repr__ = __str__


@pytest.mark.parametrize(("error", "message"), [
    (ValueError("two\nlines"), "the goal raised ValueError: two lines"),
    (KeyError("start"), "the goal raised KeyError: 'start'"),
    (AssertionError(), "the goal raised AssertionError: no message"),
    (Speechless(), "the goal raised Speechless: its message cannot be read: ValueError"),
    (SystemExit(0), "the goal raised SystemExit: 0"),
    (MemoryError(), "the goal raised MemoryError: no message"),
])
def test_an_exception_is_one_line(error, message):
    with pytest.raises(CallbackFailed) as caught, code_of_others("the goal"):
        raise error
    assert str(caught.value) == message
    assert caught.value.__cause__ is error
    assert "\n" not in describe(error)


@pytest.mark.parametrize("error", [InvalidOption("ours"), KeyboardInterrupt(), GeneratorExit()])
def test_what_is_not_a_mistake_of_others_passes(error):
    with pytest.raises(type(error)) as caught, code_of_others():
        raise error
    assert caught.value is error
