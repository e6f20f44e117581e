"""Inputs and outputs as the command line names them: an input is never changed, an output is whole or not there."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ncfix import files
from ncfix.cli import console
from ncfix.diagnostics import Place, UsageError

STREAM = "-"
"""Standard input or output as a file name."""


def read(path: str) -> bytes:
    """The content of an input file, or of standard input; raises `SourceError` NCF002."""
    if path != STREAM:
        return files.read_bytes(path)
    try:
        return sys.stdin.buffer.read()
    except OSError as error:
        raise files.unreadable(shown(path), error) from error


def shown(path: str) -> str:
    """An input's path as messages name it."""
    return "<stdin>" if path == STREAM else path


@dataclass(frozen=True, slots=True)
class Target:
    """Where the output for one input goes.

    source    the input, as the user wrote it
    path      the output; `-` is standard output
    in_place  the output takes the input's name, which is kept as `backup`
    force     an existing output may be replaced
    """

    source: str
    path: str
    in_place: bool = False
    force: bool = False

    @property
    def backup(self) -> str:
        """The name under which the input is kept when the output takes its place."""
        return f"{self.path}.orig"

    def write(self, data: bytes | Iterable[bytes]) -> None:
        """Write the output whole or not at all; raises `UsageError` NCF004 ... NCF008."""
        if self.path == STREAM:
            for part in (data,) if isinstance(data, bytes) else data:
                console.put(part)
        elif self.in_place:
            files.replace_keeping(self.path, self.backup, data)
        else:
            files.write_whole(self.path, data, replace=self.force)


def targets(
    sources: Sequence[str], output: str | None, in_place: bool, force: bool, others: Sequence[str | None] = ()
) -> list[Target]:
    """Where each output goes, which is none of the sources nor of the `others` that are read.

    Raises `UsageError` NCF003 ... NCF011 before anything is computed or written.
    """
    if in_place and output is not None:
        raise UsageError.of("NCF011", "--in-place and -o contradict each other", hint="leave one of them out")
    if in_place:
        found = [Target(source, source, in_place=True) for source in sources]
    else:
        found = [
            Target(source, path, force=force) for source, path in zip(sources, _paths(sources, output), strict=True)
        ]
    _check_clash(found)
    for target in found:
        if target.in_place:
            _check_in_place(target)
        elif target.path != STREAM:
            _check_output(target, [*sources, *(other for other in others if other)])
    return found


def _paths(sources: Sequence[str], output: str | None) -> list[str]:
    if output is None:
        if list(sources) == [STREAM]:
            return [STREAM]
        raise UsageError.of("NCF003", "no output given", hint="-o FILE, -o DIR, -o - or --in-place")
    if output != STREAM and (len(sources) > 1 or os.path.isdir(output) or output.endswith(os.sep)):
        return [os.path.join(output, _name(source, output)) for source in sources]
    return [output] * len(sources)


def _name(source: str, folder: str) -> str:
    if source == STREAM:
        hint = f"-o {os.path.join(folder, 'NAME')}"
        raise UsageError.of("NCF003", "standard input has no name to be written under", Place(folder), hint)
    return os.path.basename(source)


def _check_clash(found: Sequence[Target]) -> None:
    sources = Counter(target.path for target in found)
    for path, count in sources.items():
        if count > 1:
            names = ", ".join(target.source for target in found if target.path == path)
            hint = "fix them one by one, or into different folders"
            raise UsageError.of("NCF006", f"is the output of {count} inputs: {names}", Place(path), hint)


def _check_in_place(target: Target) -> None:
    place = Place(target.path)
    if target.path == STREAM:
        raise UsageError.of("NCF005", "standard input cannot be changed in place", hint="-o FILE")
    _check_regular(target.path)
    if os.path.lexists(target.backup):
        hint = "remove it, or bring it back and fix that"
        raise UsageError.of("NCF008", f"was fixed in place before: {target.backup} exists", place, hint)


def _check_output(target: Target, inputs: Sequence[str]) -> None:
    place = Place(target.path)
    _check_regular(target.path)
    if any(_same(target.path, each) for each in inputs):
        raise UsageError.of("NCF005", "is an input too, and inputs are not changed", place, "--in-place, or another -o")
    if os.path.lexists(target.path) and not target.force:
        raise files.exists_already(target.path)
    folder = os.path.dirname(target.path) or "."
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder))


def _check_regular(path: str) -> None:
    if os.path.islink(path):
        hint = f"name the file itself: {os.path.realpath(path)}"
        raise UsageError.of("NCF005", "is a symbolic link, which is not written through", Place(path), hint)
    if os.path.lexists(path) and not os.path.isfile(path):
        raise UsageError.of("NCF005", "is not an ordinary file", Place(path), "-o - writes to standard output")


def _same(path: str, source: str) -> bool:
    return source != STREAM and os.path.exists(path) and os.path.exists(source) and os.path.samefile(path, source)
