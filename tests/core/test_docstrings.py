"""Docstrings are read as they are written."""

from pbcs_ompl.core.docstrings import first_line, meanings


class Base:
    """One line.

    Attributes:
        low, high: Bounds
            of both.
        kept: From the base.
    """


class Other(Base):
    """Another.

    Args:
        high: Its own.

    Raises:
        ValueError: no meaning of a name.
    """


def test_meanings_come_from_the_class_and_its_bases() -> None:
    assert first_line(Other) == "Another."
    assert meanings(Base) == {"low": "Bounds of both.", "high": "Bounds of both.", "kept": "From the base."}
    assert meanings(Other) == {"low": "Bounds of both.", "high": "Its own.", "kept": "From the base."}
    assert meanings(lambda: None) == {}
