"""The project file, `ncfix.toml`: settings for the programs of a folder, so that a post only calls `ncfix fix FILE`.

It is searched for from the program's folder upwards. Paths in it are relative to its own folder.

    machine = "mill.toml"
    setup = "vise.toml"
    output = "corrected"

    [options]
    resume = true

    [[programs]]
    match = "five-axis/*.nc"
    setup = "plate.toml"

The first entry of `[[programs]]` that matches the program's path below the folder overrides the general settings.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import field
from difflib import get_close_matches
from fnmatch import fnmatchcase
from pathlib import PurePath
from typing import Any

from ncfix.diagnostics import ConfigError, Message
from ncfix.files import read_bytes
from ncfix.inputs import MAX_CONFIG_BYTES
from ncfix.toml_text import decoded, key_lines, line_of, parsed, place_of
from ncfix.toml_text import written as table_written
from ncfix.values import frozen

NAME = "ncfix.toml"
CODE = "NCF028"
TEXTS = ("machine", "setup", "output", "dialect", "tool_table")
"""Keys with text values that are options by themselves."""


@frozen
class Project:
    """A project file.

    path     as messages name it
    folder   folder of the file
    content  its settings; checked, except for names and values of options
    text     text of the file
    """

    path: str
    folder: str
    content: Mapping[str, Any] = field(repr=False)
    text: str = field(repr=False)

    @classmethod
    def of(cls, program: str) -> Project | None:
        """The project of a program, or of a folder of programs; of the working folder for `-`. None: no project."""
        if program == "-":
            start = os.getcwd()
        else:
            start = os.path.abspath(program)
            start = start if os.path.isdir(start) else os.path.dirname(start)
        for folder in (start, *map(str, PurePath(start).parents)):
            path = os.path.join(folder, NAME)
            if os.path.isfile(path):
                return cls.load(_near(path))
        return None

    @classmethod
    def load(cls, path: str) -> Project:
        """Read a project file; raises SourceError NCF002, or ConfigError NCF028 with everything that is wrong in it."""
        text = decoded(read_bytes(path, MAX_CONFIG_BYTES), path, CODE)
        content = parsed(text, path, CODE, "docs/formats.md shows a project file")
        project = cls(path, os.path.dirname(path), content, text)
        if faults := list(project._faults()):
            raise ConfigError.collected(faults)
        return project

    def settings(self, program: str) -> dict[str, Any]:
        """Option name as in the file -> value, for a program; for paths see `from_here`."""
        found: dict[str, Any] = {}
        for table in (self.content, *self._matching(program)):
            found |= {key: table[key] for key in TEXTS if key in table}
            found |= table.get("options", {})
        return found

    def is_output(self, program: str, below: str) -> bool:
        """Whether a program lies in an output folder of the project; only output folders below `below` count."""
        tables = (self.content, *self.content.get("programs", ()))
        named = [
            place["output"] for table in tables for place in (table, table.get("options", {})) if "output" in place
        ]
        folders = [self.from_here(each) for each in named if isinstance(each, str)]
        return any(way_below(each, program) and way_below(below, each) not in ("", os.curdir) for each in folders)

    def fault(self, text: str, *keys: str | int, hint: str = "") -> Message:
        """The error message for a key, with its place."""
        line = line_of(keys, key_lines(self.text))
        return Message(CODE, text, place_of(line, self.text, self.path), hint)

    def way_to(self, key: str, value: object) -> tuple[str | int, ...]:
        """The path of keys at which the file gives `key` this value, from the outermost table on."""
        programs = self.content.get("programs", ())
        tables = [((), self.content), *((("programs", number), each) for number, each in enumerate(programs))]
        for way, table in tables:
            for keys, values in ((way, table), ((*way, "options"), table.get("options", {}))):
                if key in values and values[key] is value:
                    return (*keys, key)
        return ()

    def from_here(self, path: str) -> str:
        """A path given in the file, relative to the working folder."""
        return os.path.join(self.folder, path)

    def _matching(self, program: str) -> Iterator[Mapping[str, Any]]:
        way = way_below(self.folder or os.curdir, program)
        for entry in self.content.get("programs", ()) if way else ():
            given = entry["match"]
            patterns = [given] if isinstance(given, str) else given
            if any(fnmatchcase(way.replace(os.sep, "/").lower(), each.lower()) for each in patterns):
                yield entry
                return

    def _faults(self) -> Iterator[Message]:
        yield from self._faults_of(self.content, {"ncfix", "programs"})
        programs = self.content.get("programs", [])
        if not isinstance(programs, list):
            yield self.fault("programs: must be a list of tables, [[programs]]", "programs")
            return
        for number, entry in enumerate(programs):
            where = ("programs", number)
            if not isinstance(entry, dict):
                yield self.fault(f"programs[{number}]: must be a table", *where)
                continue
            match = entry.get("match")
            if not isinstance(match, str) and not (isinstance(match, list) and all(isinstance(x, str) for x in match)):
                yield self.fault(f'programs[{number}]: needs match = "PATTERN", or a list of patterns', *where, "match")
            yield from self._faults_of(entry, {"match"}, *where)

    def _faults_of(self, table: Mapping[str, Any], others: set[str], *where: str | int) -> Iterator[Message]:
        for key, value in table.items():
            if key in TEXTS and not isinstance(value, str):
                yield self.fault(f"{key}: {value!r} is not a text", *where, key)
            elif key == "options" and not isinstance(value, dict):
                yield self.fault("options: must be a table, [options]", *where, key)
            elif key not in {*TEXTS, "options", *others}:
                close = get_close_matches(key, [*TEXTS, "options", *others], 1)
                hint = f"did you mean {close[0]}?" if close else "options of verbs belong in the table [options]"
                yield self.fault(f"{key}: there is no such key", *where, key, hint=hint)


def way_below(folder: str, path: str) -> str:
    """The path of a file relative to a folder; empty if it is not below it."""
    try:
        way = os.path.relpath(os.path.abspath(path), os.path.abspath(folder))
    except ValueError:  # another disk, on Windows
        return ""
    return "" if path == "-" or way.split(os.sep, 1)[0] == os.pardir else way


def _near(path: str) -> str:
    """A path relative to the working folder, if that is shorter."""
    try:
        return min(os.path.relpath(path), path, key=len)
    except ValueError:  # another disk, on Windows
        return path


def written(settings: Mapping[str, str], resume: bool) -> str:
    """The text of a project file with these settings, for people to edit."""
    head = "# Settings for the programs in this folder and below; docs/formats.md lists the keys.\n"
    found = table_written(head, {key: settings.get(key) for key in TEXTS})
    options = table_written("[options]              # of ncfix fix, with _ for -", {"resume": resume})
    others = ("# tolerance_um = 1.0", "# flatten = true", "", "# [[programs]]         # the first that matches wins")
    more = ('# match = "plate/*"', '# setup = "plate.toml"', "")
    return "\n".join((found, "", options, *others, *more))
