"""Output of a batch: a line for each program that was not written, a table of all results, and progress.

For a single program `ncfix fix` prints everything. For many it prints what needs attention, and counts of each kind of
result; `--verbose` prints everything, and the JSON forms always contain everything.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field
from enum import IntEnum, StrEnum
from typing import Any

from ncfix.cli import console
from ncfix.diagnostics import Code, visible
from ncfix.values import mutable

WIDEST = 60
"""Largest number of characters of an example's name in the table."""


class Verbosity(IntEnum):
    """How much is printed on programs."""

    QUIET = 0
    USUAL = 1
    ALL = 2

    @classmethod
    def of(cls, quiet: bool, verbose: bool) -> Verbosity:
        """The verbosity for the options `-q` and `-v`."""
        return cls.ALL if verbose else cls.QUIET if quiet else cls.USUAL


class OutcomeKind(StrEnum):
    """Kinds of results, as named in the table and in JSON lines."""

    WRITTEN = "written"
    UNCHANGED = "unchanged"
    DONE = "done before"
    LEFT_OUT = "left out"
    REFUSED = "refused"
    FAILED = "failed"

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> OutcomeKind:
        """The kind of the result in an entry of the JSON object."""
        if "errors" in entry:
            return cls.FAILED
        if entry["output"] is None:
            return cls.LEFT_OUT if entry.get("left_out") else cls.REFUSED
        if entry.get("resumed"):
            return cls.DONE
        return cls.WRITTEN if entry["changed"] else cls.UNCHANGED


def reasons(entry: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Code and text of each reason why a program was not written, the first reason first; empty if it was."""
    if "errors" in entry:
        return [(error["code"], error["text"]) for error in entry["errors"]]
    return [] if entry["output"] is not None else [(each["code"], each["reason"]) for each in entry["refused"]]


def brief(entry: Mapping[str, Any]) -> str:
    """The reason why a program was not written, in one line."""
    (code, text), *more = reasons(entry)
    found = entry.get("errors") or entry["refused"]
    line = f":{found[0]['line']}" if found[0].get("line") else ""
    rest = f" (and {len(more)} more)" if more else ""
    stale = "; the existing output is out of date: do not run it" if entry.get("stale") else ""
    before = ", as before" if entry.get("resumed") else ""
    return f"{visible(entry['path'])}{line}: {code}: {text.splitlines()[0]}{rest}{stale}{before}"


@mutable
class Summary:
    """Counts of results and their reasons.

    outcomes  (kind, code or "") -> number of programs, and the first of them
    remarks   code -> number of written programs with such a remark
    """

    outcomes: dict[tuple[OutcomeKind, str], list[Any]] = field(default_factory=dict)
    remarks: Counter[str] = field(default_factory=Counter)
    count: int = 0
    written: int = 0

    def add(self, entry: Mapping[str, Any]) -> None:
        """Count a program."""
        self.count += 1
        self.written += entry["output"] is not None
        code = next((code for code, _ in reasons(entry)), "")
        found = self.outcomes.setdefault((OutcomeKind.of(entry), code), [0, entry["path"]])
        found[0] += 1
        if not code:
            self.remarks.update({each["code"] for each in entry["warnings"]})

    def as_dict(self) -> dict[str, Any]:
        """The counts as plain data."""
        rows = [{"outcome": became, "code": code or None, "programs": n} for became, code, n, _ in self._rows()]
        return {"programs": self.count, "written": self.written, "outcomes": rows, "remarks": dict(self.remarks)}

    def lines(self, titles: Mapping[str, Code]) -> list[str]:
        """The table for people; `titles`: explanations of the codes."""
        rows = [("programs", "outcome", "reason")]
        for became, code, count, first in self._rows():
            example = f" ({visible(first)[-WIDEST:]}{' ...' if count > 1 else ''})" if code else ""
            rows.append((str(count), became, f"{code} {_title(titles, code)}{example}" if code else ""))
        for code, count in sorted(self.remarks.items(), key=lambda item: (-item[1], item[0])):
            rows.append((str(count), "with remark", f"{code} {_title(titles, code)}"))
        wide = max(len(became) for _, became, _ in rows)
        table = [f"{count:>8}  {became:<{wide}}  {reason}".rstrip() for count, became, reason in rows]
        return [*table, f"{self.count} programs: {self.written} written, {self.count - self.written} not"]

    def _rows(self) -> list[tuple[OutcomeKind, str, int, str]]:
        found = [(became, code, count, first) for (became, code), (count, first) in self.outcomes.items()]
        return sorted(found, key=lambda row: (list(OutcomeKind).index(row[0]), -row[2], row[1]))


def _title(titles: Mapping[str, Code], code: str) -> str:
    return titles[code].title if code in titles else ""


Advance = Callable[[], None]
"""Called when one more program is finished."""


@contextmanager
def progress(total: int) -> Iterator[Advance]:
    """Context that shows the progress on a terminal: programs finished, rate, remaining time."""
    if total == 1 or sys.stderr is None or not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    rate = TextColumn("{task.fields[rate]}")
    columns = (BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task("", total=total, rate="")

        def step() -> None:
            shown.advance(task)
            speed = shown.tasks[0].finished_speed or shown.tasks[0].speed
            shown.update(task, rate=f"{speed:.3g}/s" if speed else "")

        yield step


@mutable
class OutcomeReporter:
    """Prints the messages of finished programs.

    many  whether there are many programs: then each one that was not written gets one line, for each reason at most
          `console.MAX_MESSAGES_PER_CODE` lines; with tracebacks enabled, all messages of such a program are printed
    """

    verbosity: Verbosity
    many: bool
    seen: Counter[str] = field(default_factory=Counter)

    def report(self, entry: Mapping[str, Any], lines: list[str]) -> None:
        """Print what is wanted of one program; `lines`: all its messages."""
        wrong = reasons(entry)
        everything = self.verbosity == Verbosity.ALL or (bool(wrong) and console.is_debugging())
        if everything or (not self.many and (self.verbosity == Verbosity.USUAL or wrong)):
            for line in lines:
                console.say(line)
        elif self.many and wrong:
            code = wrong[0][0]
            self.seen[code] += 1
            if self.seen[code] <= console.MAX_MESSAGES_PER_CODE:
                console.say(brief(entry))
            elif self.seen[code] == console.MAX_MESSAGES_PER_CODE + 1:
                console.say(f"further programs with {code} are only counted; -v and --json list all")
