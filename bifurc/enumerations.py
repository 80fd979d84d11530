"""The base of kinds and statuses: words, each with a sentence that says what it means and what to try."""
from enum import StrEnum


class DescribedEnum(StrEnum):
    """An enumeration whose members are written ``NAME = "value", "sentence"``.

    Attributes
    ----------
    sentence : str
        What the member means, and what to try.
    """

    _value_: str
    sentence: str

    def __new__(cls, value: str, sentence: str = ""):
        """Make a member that equals its value."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member
