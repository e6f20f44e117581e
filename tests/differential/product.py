"""The product as a black box: the command line `ncfix`, run in this process, files in and files out."""

from __future__ import annotations

import io
import json
import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ncfix.cli.main import run

LETTERS = "XYZABCUVW"
SPLIT = re.compile(r"is up to (?P<um>[\d.]+) um from the intended path, but this motion must not be split")
DONE, FINDINGS, USAGE, UNREADABLE, REFUSED, FAULT = range(6)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run came to.

    code    exit code
    text    the corrected program; None if none was written
    entry   the object of this file that `--json` prints
    errors  the messages on standard error
    """

    code: int
    text: bytes | None
    entry: dict[str, Any] = field(default_factory=dict)
    errors: str = ""

    @property
    def refused(self) -> dict[int, str]:
        """Lines that were left as they were, and why."""
        return {int(each["line"]): str(each["reason"]) for each in self.entry.get("refused", [])}

    @property
    def left(self) -> dict[int, frozenset[int]]:
        """Line -> columns of the axes that were left where they stood."""
        found: dict[int, frozenset[int]] = {}
        for each in self.entry.get("left_where_it_stands", []):
            for first, last in each["lines"]:
                for line in range(first, last + 1):
                    found[line] = found.get(line, frozenset()) | {LETTERS.index(each["axis"])}
        return found

    @property
    def whole(self) -> dict[int, float]:
        """Line -> how far, mm, the tip leaves its path there, since the motion must not be split."""
        said = [(each["line"], SPLIT.search(each["text"])) for each in self.entry.get("warnings", [])]
        return {int(line): float(found["um"]) / 1e3 for line, found in said if found}

    @property
    def codes(self) -> list[str]:
        """Codes of the errors that ended the run."""
        return [each["code"] for each in self.entry.get("errors", [])]

    @property
    def places(self) -> list[int | None]:
        """Lines of the errors that ended the run."""
        return [each["line"] for each in self.entry.get("errors", [])]


def command(*arguments: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of one `ncfix` command line."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(argument) for argument in arguments])
    return code, out.getvalue(), err.getvalue()


def fix(program: Path, machine: Path, folder: Path, *options: object) -> Outcome:
    """Fix a file; what is written goes to `folder` under the program's own name."""
    target = folder / f"fixed-{program.name}"
    target.unlink(missing_ok=True)
    code, out, err = command("fix", program, "-m", machine, "-o", target, "--json", *options)
    try:
        answer = json.loads(out)
    except json.JSONDecodeError:
        answer = {}
    entry = answer.get("files", [{"errors": answer.get("errors", [])}])[0]
    return Outcome(code, target.read_bytes() if target.exists() else None, entry, err)


def fix_text(text: str | bytes, machine: Path, folder: Path, *options: object, name: str = "program.ngc") -> Outcome:
    """Fix a program given as text."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode("latin-1"))
    return fix(path, machine, folder, *options)
