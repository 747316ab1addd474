import signal

pytest_plugins = ["pytester"]


def pytest_configure() -> None:
    """Hear Ctrl-C: a pytest that a shell has started in the background ignores it, and so would what we interrupt."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
