"""How a program of SINUMERIK leads from line to line: loops, branches, subprograms in the text; for judging."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Protocol

PROCEDURE = re.compile(r"PROC (\w+)\(")
CALL = re.compile(r"(\w+)\(([^()]*)\)")
LETTING = re.compile(r"(R\d+)\s*=\s*([^=].*)")
CONTOUR = re.compile(r'CYCLE72\("(\w+):(\w+)",(.*)\)')
FOR = re.compile(r"FOR (\w+)=(.+) TO (.+)")


class Executes(Protocol):
    """What executes lines."""

    mark: tuple[int, int]
    line: int

    def assign(self, name: str, value: float) -> None:
        """Give a variable its value."""

    def value(self, text: str) -> Any:
        """The value of an expression."""

    def block(self, body: str) -> None:
        """Do what a line says that leads nowhere else."""

    def along(self, bodies: list[tuple[int, str]], values: list[float]) -> None:
        """Mill along lines of the text, each with its number."""


class Walk:
    """A program text, and where in it a control is: `at` is the line that comes next."""

    def __init__(self, control: Executes, text: str) -> None:
        self.control = control
        self.lines = text.splitlines()
        self.at = 0
        self.loops: list[tuple[int, str, float]] = []
        self.calls: list[int] = []
        self.procedures = {found[1]: n for n, line in enumerate(self.lines) if (found := PROCEDURE.match(line))}

    def run(self) -> None:
        """To the end of the program."""
        while self.at < len(self.lines):
            body = self.take()
            if body in ("M30", "M2"):
                return
            if not self.leads(body) and body and not body.startswith(("ENDIF", "%")):
                self.control.block(body)

    def take(self) -> str:
        """The next line, without its comment, texts and number."""
        line = self.lines[self.at]
        if mark := re.search(r";#(\d+)", line):
            self.control.mark = int(mark[1]), self.control.mark[1] + 1
        body = re.sub(r'"([^"]*)"', r"0", line.split(";")[0].upper()).strip()
        self.at += 1
        self.control.line = self.at
        return re.sub(r"^(?:/\d?\s*)?(?:N\d+\s*)?", "", body)

    def leads(self, body: str) -> bool:
        """Follow a line that sets a variable or says which one comes next; False if it does not."""
        if found := FOR.fullmatch(body):
            self.control.assign(found[1], self.control.value(found[2]))
            self.loops.append((self.at, found[1], self.control.value(found[3])))
        elif found := CONTOUR.search(self.lines[self.at - 1]):
            first, last = (n for n, line in enumerate(self.lines) if line.startswith((f"{found[1]}:", f"{found[2]}:")))
            inner = [(n + 1, line) for n, line in enumerate(self.lines[first + 1 : last], first + 1)]
            self.control.along(inner, [float(part or "0") for part in found[3].split(",")])
        elif (found := CALL.fullmatch(body)) and found[1] in self.procedures:
            self.call(found[1], found[2])
        elif found := LETTING.fullmatch(body):
            self.control.assign(found[1], self.control.value(found[2]))
        else:
            plain: dict[str, Callable[[str], None]] = {
                "WHILE": self.begin_while,
                "ENDWHILE": self.again,
                "ENDFOR": self.end_for,
                "IF": self.branch,
                "ELSE": self.otherwise,
                "M17": self.back,
            }
            word = body.partition(" ")[0]
            if word not in plain:
                return False
            plain[word](body.partition(" ")[2])
        return True

    def call(self, name: str, arguments: str) -> None:
        """Into a subprogram."""
        self.calls.append(self.at)
        self.at = self.procedures[name] + 1
        names = re.findall(r"REAL (\w+)", self.lines[self.at - 1])
        for each, value in zip(names, arguments.split(","), strict=True):
            self.control.assign(each, self.control.value(value))

    def back(self, _: str) -> None:
        """Out of it."""
        self.at = self.calls.pop()

    def begin_while(self, condition: str) -> None:
        """Into a loop, or past it."""
        if self.control.value(condition):
            self.loops.append((self.at - 1, "", 0.0))
        else:
            self.at = 1 + next(n for n in range(self.at, len(self.lines)) if self.lines[n].startswith("ENDWHILE"))

    def again(self, _: str) -> None:
        """Back to its condition."""
        self.at = self.loops.pop()[0]

    def end_for(self, _: str) -> None:
        """Once more, or on."""
        begin, name, last = self.loops[-1]
        self.control.assign(name, self.control.value(name) + 1)
        if self.control.value(name) <= last:
            self.at = begin
        else:
            self.loops.pop()

    def branch(self, condition: str) -> None:
        """IF: past the branch that is not taken."""
        depth = 0 if self.control.value(condition) else 1
        while depth:
            inner = self.lines[self.at].strip().upper()
            depth += inner.startswith("IF ") - inner.startswith("ENDIF")
            self.at += 1
            if depth == 1 and inner.startswith("ELSE"):
                return

    def otherwise(self, _: str) -> None:
        """ELSE behind the branch that was taken."""
        while not self.lines[self.at].strip().upper().startswith("ENDIF"):
            self.at += 1
