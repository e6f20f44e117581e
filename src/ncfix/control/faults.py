"""What stops the control: a fault is raised where it is found and gets its place in the file on its way out."""

from __future__ import annotations

from ncfix.text.tree import Span


class Fault(Exception):  # noqa: N818 - a fault of the program that is followed, not of ncfix
    """The control would stop here, or cannot be followed further.

    code  the coded error
    text  what is the matter, plain words
    hint  what to do about it
    span  where in the block, None for the whole block
    """

    def __init__(self, code: str, text: str, hint: str = "", span: Span | None = None) -> None:
        super().__init__(code, text)
        self.code = code
        self.text = text
        self.hint = hint
        self.span = span

    def at(self, span: Span | None) -> Fault:
        """The same fault at a place in the block, if it has none yet."""
        if self.span is None:
            self.span = span
        return self
