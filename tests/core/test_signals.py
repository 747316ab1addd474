"""SIGTERM and SIGHUP ask to stop as Ctrl-C does; handlers of a host application stay."""

import ctypes
import os
import signal
import sys
import threading
import time

import pytest

from pbcs_ompl.core.signals import STOPPING, interruptible, signal_of, signals_interrupt, with_remedy


@pytest.fixture(autouse=True)
def usual_handlers():
    """Set the handlers of a process that was started from a terminal; `nohup` leaves another one."""
    usual = {number: signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
             for number in STOPPING}
    yield
    for number, handler in usual.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", STOPPING)
def test_the_first_signal_is_noted_and_the_second_raises(number):
    seen = []
    with pytest.raises(KeyboardInterrupt) as caught, signals_interrupt(), interruptible(seen.append):  # noqa: PT012
        os.kill(os.getpid(), number)
        assert [signal_of(error) for error in seen] == [number]
        os.kill(os.getpid(), number)
    assert signal_of(caught.value) == number


@pytest.mark.parametrize("number", STOPPING)
def test_elsewhere_it_raises_at_once(number):
    with pytest.raises(KeyboardInterrupt) as caught, signals_interrupt():
        os.kill(os.getpid(), number)
    assert signal_of(with_remedy(caught.value, "go on")) == number
    assert str(with_remedy(caught.value, "go on")) == "go on"


@pytest.mark.parametrize("number", STOPPING)
def test_in_a_callback_of_c_it_raises_a_moment_later(number):
    callback = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), number))
    with pytest.raises(KeyboardInterrupt) as caught, signals_interrupt():  # noqa: PT012
        callback()
        end = time.monotonic() + 10
        while time.monotonic() < end:
            time.sleep(0.001)
    assert signal_of(caught.value) == number


def test_other_dropped_exceptions_are_reported(monkeypatch):
    reported = []
    monkeypatch.setattr(sys, "unraisablehook", lambda dropped: reported.append(dropped.exc_type))
    with signals_interrupt():
        ctypes.CFUNCTYPE(None)(lambda: 1 / 0)()
    assert reported == [ZeroDivisionError]


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda *_: None])
def test_what_others_have_chosen_stays(handler):
    before = signal.signal(signal.SIGTERM, handler)
    try:
        with signals_interrupt(), interruptible(pytest.fail):
            os.kill(os.getpid(), signal.SIGTERM)
            assert signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, before)


def test_handlers_are_given_back():
    before = [signal.getsignal(number) for number in STOPPING]
    with signals_interrupt(), interruptible(pytest.fail):
        pass
    assert [signal.getsignal(number) for number in STOPPING] == before


def test_another_thread_changes_nothing():
    def work():
        with signals_interrupt(), interruptible(pytest.fail):
            found.append([signal.getsignal(number) for number in STOPPING])

    found, before = [], [signal.getsignal(number) for number in STOPPING]
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [before]
