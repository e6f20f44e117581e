"""A worked story: a folder with a README whose console blocks are what a user types and sees. So are the pages of the
guide (docs/guide), each in a copy of one folder.

Blocks start with three backticks and `console`; in them a line that starts with `$ ` is a command, the lines up to the
next one are what it prints on a terminal (standard error included), and a line `...` stands for lines left out.
"""

from __future__ import annotations

import io
import math
import os
import re
import shlex
from collections.abc import Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import cast
from unittest.mock import patch

from ncfix.cli import main

FENCE = re.compile(r"(?<=^```console\n).*?(?=^```$)", re.MULTILINE | re.DOTALL)
LEFT_OUT = "..."
GUIDE = "examples/guide"
"""The folder in which every page of the guide begins."""
NUMBER = re.compile(r"(?<![A-Za-z0-9_.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![A-Za-z0-9_])")
UNSTEADY = re.compile(r"p = \S+(?=[),;])|log odds \d+|, \d+ less")
"""Figures that the last digits of a computer's arithmetic decide."""
RELATIVE, ABSOLUTE = 0.1, 0.15
"""How far figures may be from the printed ones: sums in another order, another release of a library."""
ENDS = (0, 1, 2, 4)
"""Exit codes of a step: done, findings, something that has to be given, a refusal; never a fault."""


@dataclass(frozen=True, slots=True)
class Step:
    """A command line and the lines shown after it."""

    command: str
    shown: tuple[str, ...]


def steps(readme: str) -> Iterator[Step]:
    """The steps of a story, in order."""
    for block in FENCE.finditer(readme):
        yield from _steps(block[0])


def _steps(block: str) -> Iterator[Step]:
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, *shown = part.rstrip().split("\n")
        yield Step(command, tuple(shown))


def run(command: str, folder: Path) -> list[str]:
    """The lines that a command, run in this process, prints in a folder; `> FILE` at its end puts its standard output
    there instead.

    RuntimeError: it ended with a fault, or cannot read a file.
    """
    program, *arguments = shlex.split(command)
    if program != "ncfix":
        raise ValueError(f"{command}: a story runs ncfix only")
    target = arguments[-1] if arguments[-2:-1] == [">"] else None
    told = io.TextIOWrapper(io.BytesIO(), "utf-8", newline="")
    written = io.TextIOWrapper(io.BytesIO(), "utf-8", newline="") if target else told
    with chdir(folder), patch.dict(os.environ, {"NO_COLOR": "1", "COLUMNS": "120"}):
        with redirect_stdout(written), redirect_stderr(told):
            code = main.run(arguments[:-2] if target else arguments)
        printed, output = (text_of(each) for each in (told, written))
        if code not in ENDS:
            raise RuntimeError(f"{command}: exit code {code}\n{printed}")
        if target:
            Path(target).write_text(output)
    return printed.rstrip("\n").split("\n") if printed else []


def text_of(written: io.TextIOWrapper) -> str:
    """What was written."""
    written.flush()
    return cast(io.BytesIO, written.buffer).getvalue().decode()


def alike(shown: tuple[str, ...], printed: list[str]) -> bool:
    """Whether what is printed is what is shown: the same words, and about the same figures."""
    if not shown:
        return not printed
    first, *rest = shown
    if first == LEFT_OUT:
        return any(alike(tuple(rest), printed[start:]) for start in range(len(printed) + 1))
    return bool(printed) and _same(first, printed[0]) and alike(tuple(rest), printed[1:])


def headlines(lines: Sequence[str]) -> list[str]:
    """What a diagnosis says: its verdict, and the lines with a name (the next one gives its odds).

    The rest of it, runners-up and patterns, is for the reader.
    """
    verdict = [":".join(line.split(":")[:2]) for line in lines if line.startswith("verdict:")]
    return verdict + [name for name, odds in pairwise(lines) if "log odds" in odds]


def _same(shown: str, printed: str) -> bool:
    texts = [UNSTEADY.sub("", text.rstrip()) for text in (shown, printed)]
    words = [NUMBER.sub("#", text).split() for text in texts]
    figures = [[float(number) for number in NUMBER.findall(text)] for text in texts]
    near = (math.isclose(a, b, rel_tol=RELATIVE, abs_tol=ABSOLUTE) for a, b in zip(*figures, strict=False))
    return words[0] == words[1] and all(near)


def written_anew(readme: str, folder: Path) -> str:
    """The README with what its commands print now, run in that folder.

    What leaves lines out stays if it still holds.
    """

    def block(found: re.Match[str]) -> str:
        return "".join(f"$ {step.command}\n{_shown(step, run(step.command, folder))}" for step in _steps(found[0]))

    return FENCE.sub(block, readme)


def _shown(step: Step, printed: list[str]) -> str:
    lines = step.shown if LEFT_OUT in step.shown and alike(step.shown, printed) else printed
    return "".join(f"{line.rstrip()}\n" for line in lines)
