"""The two output streams: data on standard output, messages on standard error, and nothing else.

All terminal output passes through here, so that nothing in names, programs or machine files can control the terminal.
Text for people is always made visible (`diagnostics.visible`); data is changed only if it goes to a terminal. Messages
that say the same of several lines are merged into one that names all lines. Bugs are reported as bugs, never as
mistakes of the user.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import replace
from threading import Timer
from typing import Any, TextIO

import click

from ncfix.diagnostics import FaultError, Message, NcfixError, Place, PluginError, UsageError, lines_named, visible
from ncfix.files import unwritable
from ncfix.plugins import blamed

FIGURE = re.compile(r"(?<![-.\w])\d+(?:\.\d+)?(?:e[-+]\d+)?(?= (?:mm|um|degrees|times)\b(?!/))")
"""The quantity in a message."""
SCHEMA = 1
"""Schema version of the objects printed with `--json`."""
CODE = re.compile(r"\bNCF\d{3}:")
MAX_MESSAGES_PER_CODE = 20
"""Largest number of messages of one code that are printed."""
BUSY_AFTER_S = 2.0
"""Time, s, after which progress is shown on a terminal."""
_collected: ContextVar[list[str] | None] = ContextVar("collected", default=None)
DEBUG = "NCFIX_DEBUG"
"""Environment variable that enables tracebacks; workers inherit it."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Error numbers of the system for lack of space, which are never bugs."""


def said_once(messages: Iterable[Message]) -> list[Message]:
    """Each message once, at its first place, with the other lines to which it applies.

    Messages that differ only in a quantity are represented by the one with the largest value.
    """
    groups: dict[tuple[str, ...], list[Message]] = {}
    for number, message in enumerate(messages):
        place = message.place
        alone = "" if place is not None and place.line else str(number)
        key = message.code, _kind(message.text), message.hint, place.path if place else "", alone
        groups.setdefault(key, []).append(message)
    return [_as_one(group) for group in groups.values()]


def _as_one(group: Sequence[Message]) -> Message:
    most = max(group, key=lambda message: _size(message.text))
    if len(group) == 1:
        return most
    import numpy as np

    from ncfix.arrays import in_stretches

    lines = np.array(sorted({message.place.line for message in group if message.place}), dtype=np.int64)
    shown = "" if all(message.text == most.text for message in group) else "; the largest is shown"
    return replace(most, text=f"{most.text} ({len(group)} times, {lines_named(in_stretches(lines))}{shown})")


def _kind(text: str) -> str:
    """A text without its quantity; a text with several quantities is left unchanged."""
    found = FIGURE.findall(text)
    return FIGURE.sub("", text) if len(found) == 1 else text


def _size(text: str) -> float:
    """The quantity in a text; 0 without one."""
    found = FIGURE.search(text)
    return float(found[0]) if found else 0.0


class ReaderGoneError(Exception):
    """The reader of standard output has closed it."""


def say(text: str) -> None:
    """Print a line for people on standard error; on a terminal, the first message code in it is bold."""
    lines = _collected.get()
    if lines is not None:
        lines.append(text)
        return
    seen = CODE.sub(lambda found: click.style(found[0], bold=True), visible(text, lines=True), count=1)
    with suppress(OSError, AttributeError):  # nobody can be told that nobody can be told; exit codes still say it
        click.echo(seen, err=True, color=colour())


def forewarn(text: str) -> None:
    """On a terminal, print a line about something that will take time."""
    if _watched():
        say(text)


def _watched() -> bool:
    """Whether somebody can see messages on a terminal at once."""
    return _collected.get() is None and sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def keeping() -> Iterator[list[str]]:
    """Context in which messages of this thread are collected instead of printed."""
    lines: list[str] = []
    token = _collected.set(lines)
    try:
        yield lines
    finally:
        _collected.reset(token)


def tell(*messages: Message) -> None:
    """Print coded messages on standard error; one without a hint refers to the explanation of its code."""
    for plain in messages:
        message = replace(plain, hint=plain.advice)
        say(str(message))


def tell_some(messages: Iterable[Message], shown: Callable[[list[Message]], Iterable[Message]] = list) -> None:
    """Print coded messages, equal ones merged. Beyond `MAX_MESSAGES_PER_CODE`, only their number is printed.

    shown  selects or changes the messages before they are printed
    """
    seen: Counter[str] = Counter()
    first = []
    for message in said_once(messages):
        seen[message.code] += 1
        if seen[message.code] <= MAX_MESSAGES_PER_CODE:
            first.append(message)
    tell(*shown(first))
    for code, count in seen.items():
        if count > MAX_MESSAGES_PER_CODE:
            tell(Message(code, f"and {count - MAX_MESSAGES_PER_CODE} more like these", hint="--json lists all"))


def put(data: str | bytes) -> None:
    """Print on standard output and flush: text for people made visible, data unchanged unless it goes to a terminal."""
    if sys.stdout is None:
        raise UsageError.of("NCF007", "is closed", Place("<stdout>"), "-o FILE")
    try:
        if isinstance(data, bytes) and sys.stdout.isatty():
            data = data.decode("utf-8", "surrogateescape")
        click.echo(visible(data, lines=True) if isinstance(data, str) else data, nl=False, color=colour())
        sys.stdout.flush()
    except BrokenPipeError as error:
        abandon_stdout()
        raise ReaderGoneError from error
    except OSError as error:
        abandon_stdout()
        raise unwritable("<stdout>", error) from error


def put_all(parts: Iterable[bytes]) -> None:
    """Write data to standard output, part by part."""
    for part in parts:
        put(part)


def put_json(**content: object) -> None:
    """Print one JSON object, see `json_text`."""
    put(json_text(**content))


def json_text(indent: int | None = 1, /, **content: object) -> str:
    """One JSON object with its schema version, in visible ASCII; numbers that are not finite become null.

    indent  indentation; None: all on one line
    """
    text = json.dumps({"schema": SCHEMA, **{key: _plain(value) for key, value in content.items()}}, indent=indent)
    return text.replace("\x7f", "\\u007f") + "\n"


def _plain(value: Any) -> Any:
    """A value in the types of JSON: messages as objects, arrays as lists, no NaN."""
    if isinstance(value, Message):
        return value.as_dict()
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def counted(count: int, thing: str) -> str:
    """A number with its noun: "1 block", "2 blocks"."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def error_figures(error: Mapping[str, Any]) -> str:
    """The figures of an error along a path, in words."""
    if error["max"] is None:
        return "none: no motion was examined"
    where = f", worst at line {error['where']}" if error.get("where") else ""
    return f"max {error['max']:.2f} um, rms {error['rms']:.2f} um{where}"


def no_figure(found: Mapping[str, int]) -> str:
    """The number of motions without figures, and the reasons, most frequent first."""
    reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(found.items(), key=lambda item: -item[1]))
    return f"no figure for {counted(sum(found.values()), 'motion')} at feed: {reasons}"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table: aligned columns, or a drawn table on a terminal."""
    header, *rows = (tuple(map(visible, row)) for row in (header, *rows))
    if sys.stdout is not None and sys.stdout.isatty():
        _drawn(header, rows)
        return
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    for row in (header, *rows):
        put("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() + "\n")


def _drawn(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    drawn = Table(*header, box=SIMPLE_HEAD, pad_edge=False)
    for row in rows:
        drawn.add_row(*map(Text, row))
    Console().print(drawn)


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Context that shows on a terminal what is being done, if it takes long."""
    if not _watched():
        yield
        return
    from rich.console import Console
    from rich.text import Text

    status = Console(stderr=True).status(Text(visible(what)))
    timer = Timer(BUSY_AFTER_S, status.start)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        status.stop()


def colour() -> bool | None:
    """False if `NO_COLOR` is set; None: depends on the stream."""
    return False if os.environ.get("NO_COLOR") else None


def abandon_stdout() -> None:
    """Redirect standard output to nothing, so that Python's exit does not fail on what could not be written."""
    _abandon(sys.stdout)


def abandon_unwritable() -> None:
    """Redirect streams whose content cannot be written to nothing; otherwise Python's exit would fail (120)."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except (OSError, ValueError):
            _abandon(stream)


def _abandon(stream: TextIO) -> None:
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def owned(error: Exception) -> NcfixError:
    """The error to report for an exception: a coded one if possible, else a fault of ncfix."""
    from ncfix import core

    if isinstance(error, NcfixError):
        if error.__cause__ is not None and isinstance(error, PluginError):
            _trace(error.__cause__)
        return error
    if isinstance(error, OSError) and error.errno in FULL:
        return unwritable(str(error.filename or "<stdout>"), error)
    plugin = blamed(error)
    if plugin is not None:
        _trace(error)
        return plugin
    if isinstance(error, MemoryError):
        hint = "use less data, or a computer with more memory"
        return FaultError.of("NCF024", "not enough memory", hint=hint)
    if isinstance(error, core.UnusableCoreError):
        return UsageError.of("NCF001", str(error), hint=f"unset {core.WISH}")
    return fault(error)


def is_debugging() -> bool:
    """Whether tracebacks are enabled."""
    return os.environ.get(DEBUG, "") not in ("", "0")


def _trace(error: BaseException) -> None:
    """Print the traceback if enabled."""
    import traceback

    if is_debugging():
        say("".join(traceback.format_exception(error)))


def fault(error: Exception) -> FaultError:
    """The error for a bug of ncfix; its traceback is printed if enabled."""
    import traceback

    _trace(error)
    where = traceback.extract_tb(error.__traceback__)[-1]
    at = f"{os.path.basename(where.filename)}:{where.lineno}"
    text = f"internal fault of ncfix: {type(error).__name__}: {error} ({at})"
    return FaultError.of(
        "NCF000", text, hint="run it again with ncfix --debug, and report the traceback with the input"
    )


@contextmanager
def debugging(wanted: bool) -> Iterator[None]:
    """Context in which tracebacks are enabled if `wanted`, as by the environment variable."""
    before = os.environ.get(DEBUG)
    if wanted:
        os.environ[DEBUG] = "1"
    try:
        yield
    finally:
        if wanted:
            os.environ.pop(DEBUG)
            os.environ.update({} if before is None else {DEBUG: before})
