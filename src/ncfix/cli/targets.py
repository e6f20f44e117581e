"""Inputs and outputs of the command line: inputs are never changed, outputs are written completely or not at all."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import IO
from weakref import WeakSet

from ncfix import files, inputs
from ncfix.batch.programs import ProgramFile, program_files
from ncfix.cli import console
from ncfix.diagnostics import Place, UsageError
from ncfix.inputs import identities, identity
from ncfix.outputs import check_named, check_output, check_target, folded_name
from ncfix.values import frozen

STREAM = "-"
"""File name for standard input or output."""
JSON = "the JSON object"
"""Name of the output of `--json` in messages."""
_TAKEN: WeakSet[IO[bytes]] = WeakSet()
"""Contains standard input after an input has been read from it."""


def read(path: str) -> bytes:
    """The content of an input file, or of standard input; raises `SourceError` NCF002."""
    if path != STREAM:
        return files.read_bytes(path)
    try:
        return inputs.content(stdin())
    except OSError as error:
        raise files.unreadable(shown(path), error) from error


def stdin() -> IO[bytes]:
    """Standard input, once; raises `SourceError` NCF002 if it is closed, `UsageError` NCF022 if it was used already."""
    if sys.stdin is None:
        raise files.unreadable(shown(STREAM), OSError(errno.EBADF, "it is closed"))
    stream = sys.stdin.buffer
    try:
        inputs.check(stream)
    except OSError as error:
        raise files.unreadable(shown(STREAM), error) from error
    if stream in _TAKEN:
        text = "standard input is given for two inputs, but can be read only once"
        raise UsageError.of("NCF022", text, hint="give one of them as a file")
    _TAKEN.add(stream)
    return stream


def shown(path: str) -> str:
    """The path of an input in messages."""
    return "<stdin>" if path == STREAM else path


@frozen
class OutputTarget:
    """The destination of the output for one input.

    source    the input, as given by the user
    path      the output; `-` is standard output
    in_place  the output gets the input's name, and the input is kept as `backup`
    force     whether an existing output may be replaced
    resume    whether an existing output is accepted if it equals what would be written
    made      digests of outputs that ncfix has written there; with `resume`, these may be replaced
    name      path of the output below the output folder; empty without a folder
    root      the output folder, as given by the user; None without a folder
    program   the input as found in a folder; None if it was not
    """

    source: str
    path: str
    in_place: bool = False
    force: bool = False
    resume: bool = False
    name: str = ""
    root: str | None = None
    made: frozenset[str] = frozenset()
    program: ProgramFile | None = None

    @property
    def is_own(self) -> bool:
        """Whether the existing output was made by ncfix and not changed since."""
        from ncfix.batch.journal import digest_of

        return bool(self.made) and digest_of(self.path) in self.made

    @property
    def backup(self) -> str:
        """The name under which the input is kept if the output replaces it."""
        return f"{self.path}.orig"

    @property
    def file(self) -> str | None:
        """The output's path; None for standard output."""
        return None if self.path == STREAM else self.path

    def write(self, data: bytes | Iterable[bytes], mode: int | None = None) -> None:
        """Write the output completely or not at all; raises `UsageError` NCF004 ... NCF008, NCF023.

        mode  permission bits of a new file, as in `files.write_whole`
        """
        if self.path == STREAM:
            console.put_all((data,) if isinstance(data, bytes) else data)
        elif self.in_place:
            files.replace_keeping(self.path, self.backup, data)
        elif self.resume and not self.force and os.path.lexists(self.path):
            if not files.holds(self.path, data):
                if not self.is_own:
                    text = "exists already, and is not the output that ncfix wrote for this program"
                    raise UsageError.of("NCF004", text, Place(self.path), "move it away, or replace it with --force")
                files.write_whole(self.path, data, True, self.root, mode)
        else:
            files.write_whole(self.path, data, self.force, self.root, mode)


@frozen
class Outputs:
    """The outputs as asked for on the command line.

    output    a file, a folder, or `-` for standard output; None: not given
    in_place  outputs replace their inputs
    force     existing outputs may be replaced
    resume    outputs of an earlier run are not made again
    base      programs below this folder keep their path below it in the output folder; None: only their names
    """

    output: str | None = None
    in_place: bool = False
    force: bool = False
    resume: bool = False
    base: str | None = None

    def folder(self, given: Sequence[str]) -> str | None:
        """The output folder; None if the output is not a folder."""
        if self.in_place or self.output in (None, STREAM):
            return None
        assert self.output is not None
        many = len(given) > 1 or any(os.path.isdir(path) for path in given)
        return self.output if many or os.path.isdir(self.output) or self.output.endswith(os.sep) else None


def targets(
    given: Sequence[str],
    outputs: Outputs,
    others: Sequence[str | None] = (),
    folders: bool = False,
    only: Collection[str] | None = None,
) -> list[OutputTarget]:
    """The destination of each output; it must be neither a program nor one of the `others` that are read.

    folders  whether a folder among the inputs stands for all programs below it
    only     paths of the programs that are meant; None: all

    Raises `UsageError` NCF003 ... NCF016 before anything is computed or written.
    """
    folder = outputs.folder(given)
    check_named(outputs.output)
    if outputs.in_place and outputs.output is not None:
        raise UsageError.of("NCF011", "--in-place and -o contradict each other", hint="use one of them")
    if outputs.resume and folder is None:
        raise UsageError.of(
            "NCF016", "--resume continues with a folder of outputs, but no folder is given", hint="-o FOLDER"
        )
    programs = (
        program_files(given, folder) if folders else [ProgramFile(path, os.path.basename(path)) for path in given]
    )
    if only is not None:
        programs = [program for program in programs if program.path in only]
    if outputs.base is not None:
        from ncfix.project import way_below

        programs = [replace(each, name=way_below(outputs.base, each.path) or each.name) for each in programs]
    if outputs.in_place:
        found = [OutputTarget(program.path, program.path, in_place=True, program=program) for program in programs]
    else:
        found = [_target(program, outputs, folder) for program in programs]
    _check_clash(found)
    read = identities([*(program.path for program in programs), *(other for other in others if other)])
    for target in found:
        if target.in_place:
            _check_in_place(target)
        elif target.path != STREAM:
            check_target(target.path, read, target.force, target.root, target.resume)
    return found


def check_streams(printed: str | None, **outputs: OutputTarget | None) -> None:
    """Refuse more than one output on standard output: NCF010.

    printed  name of what is always printed there; None: nothing
    outputs  other outputs by name; None if not wanted
    """
    streamed = [f"the {name}" for name, target in outputs.items() if target is not None and target.path == STREAM]
    if printed is not None:
        streamed.append(printed)
    if len(streamed) > 1:
        raise UsageError.of("NCF010", f"{' and '.join(streamed)} would both go to standard output", hint="-o FILE")


def _target(program: ProgramFile, outputs: Outputs, folder: str | None) -> OutputTarget:
    if folder is not None:
        if program.path == STREAM:
            hint = f"-o {os.path.join(folder, 'NAME')}"
            raise UsageError.of(
                "NCF003", "the output in a folder needs a file name, and standard input has none", Place(folder), hint
            )
        path = os.path.join(folder, program.name)
        how = (False, outputs.force, outputs.resume, program.name, folder)
        return OutputTarget(program.path, path, *how, program=program)
    if outputs.output is None and program.path != STREAM:
        raise UsageError.of("NCF003", "no output given", hint="-o FILE, -o DIR, -o - or --in-place")
    return OutputTarget(program.path, outputs.output or STREAM, force=outputs.force)


def _check_clash(found: Sequence[OutputTarget]) -> None:
    """Refuse outputs that are the same file, also on file systems that ignore the case of names."""
    same: dict[object, list[OutputTarget]] = {}
    for target in found:
        same.setdefault((target.in_place and identity(target.path)) or folded_name(target.path), []).append(target)
    for group in same.values():
        if len(group) > 1:
            sources = ", ".join(target.source for target in group)
            text = f"is the output of {len(group)} inputs: {sources}"
            if len({target.path for target in group}) > 1:
                text = "differs from another output only in upper and lower case, or in how accented letters are coded"
                text += f"; of these inputs: {sources}"
            hint = "fix them one by one, or into different folders"
            raise UsageError.of("NCF006", text, Place(group[1].path), hint)


def _check_in_place(target: OutputTarget) -> None:
    place = Place(target.path)
    if target.path == STREAM:
        raise UsageError.of("NCF005", "standard input cannot be changed in place", hint="-o FILE")
    check_output(target.path)
    if os.path.lexists(target.backup):
        hint = "rename it back to the program and fix that, or remove it"
        raise UsageError.of("NCF008", f"was already fixed in place: {target.backup} exists", place, hint)
