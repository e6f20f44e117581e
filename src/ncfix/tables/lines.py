"""Faults in table files, with their places: what the linters of the plugins say it with."""

from __future__ import annotations

from dataclasses import dataclass, field

from ncfix.diagnostics import ConfigError, Message, Place


@dataclass(slots=True)
class Remarks:
    """What was found in one file so far. `wrong` is what the control would not load or would misread."""

    path: str
    rows: list[str] = field(default_factory=list)
    wrong: list[Message] = field(default_factory=list)
    doubtful: list[Message] = field(default_factory=list)

    @classmethod
    def of(cls, path: str, content: bytes) -> Remarks:
        """An empty list for a file; a byte that is not ASCII is noted, once."""
        remarks = cls(path, content.decode("latin-1").splitlines())
        for number, row in enumerate(remarks.rows, 1):
            if not row.isascii():
                remarks.refuse(number, "a character that is not ASCII", "controls read plain ASCII")
                break
        return remarks

    def refuse(self, line: int, text: str, hint: str = "export again") -> None:
        """NCF491: the control would not load this, or read it otherwise than it looks."""
        self.wrong.append(Message("NCF491", text, self._place(line), hint))

    def doubt(self, line: int, text: str, hint: str = "") -> None:
        """NCF492: this is rarely meant."""
        self.doubtful.append(Message("NCF492", text, self._place(line), hint))

    def check(self) -> None:
        """Raise `ConfigError` with everything that is wrong, if anything is."""
        if self.wrong:
            raise ConfigError.collected(self.wrong)

    @property
    def messages(self) -> tuple[Message, ...]:
        """All, what is wrong first."""
        return (*self.wrong, *self.doubtful)

    def _place(self, line: int) -> Place:
        return Place(self.path, line, 0, self.rows[line - 1] if 0 < line <= len(self.rows) else "")
