"""Text as UTF-8, whatever the locale is."""

from pbcs_ompl.core.errors import InvalidOption


def utf8(text: str) -> bytes:
    """Return text as UTF-8.

    The bytes of a file name that the locale has no characters for (Python keeps them as lone surrogates) become those
    characters that they are in UTF-8, else U+FFFD.

    Raises:
        InvalidOption: the text holds another lone surrogate, which no file can hold.
    """
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace").encode("utf-8")
    except UnicodeEncodeError as error:
        raise InvalidOption(f"{text[error.start:error.end]!a} is half a character, which no file can hold; expected "
                            "text") from error


def joined(text: str) -> str:
    """Return a word of the command line whose characters the locale lacks, and Python therefore gave byte by byte."""
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "surrogateescape")
    except UnicodeEncodeError:  # another lone surrogate
        return text
