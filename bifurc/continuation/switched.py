"""What leaves a special point: starts on other branches, and a sentence on them."""


class Switched(tuple[object, ...]):
    """Start objects on other branches, with ``status``: a sentence that says what was found, or why nothing was."""

    status: str

    def __new__(cls, starts, status):
        """Join the starts with the sentence."""
        made = super().__new__(cls, starts)
        made.status = status
        return made

    def __getnewargs__(self):
        """Return what a copy is made of."""
        return tuple(self), self.status

    def __repr__(self) -> str:
        return f"Switched({len(self)} starts: {self.status})"
