"""One case of the goldens: command lines of `ncfix`, run in this process, and the texts that come of them.

Only the command line is used, so that a case stays the same whatever becomes of the code behind it.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import signal
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

Texts = dict[str, str]

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
LIMIT = "time limit"
"""What stands for every text of a case that took too long."""
LATE = "late"
"""The digest of that."""
DIGITS = 8
"""Of a digest."""
DECIMALS, SIGNIFICANT = 7, 7
"""Of numbers in tables of motions, mm and degrees, and in all other texts but corrected programs."""

NUMBER = re.compile(r"(?<![\w.])-?\d+\.\d+(?:e[+-]?\d+)?(?![\w.]*\d)", re.IGNORECASE)
UNSTEADY = (
    (re.compile(r"(?i)(ncfix) \d+\.\d+\.\d+\S*"), r"\1 VERSION"),
    (re.compile(r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d)?Z?)?"), "DATE"),
    (re.compile(r'"dialect": "[^"]*",\s*(?="output")'), ""),
)
"""What differs from day to day; and as what `fix` read a program, which it said not yet when the digests were made."""


@dataclass(frozen=True, slots=True)
class Step:
    """A command line, and the text that its standard output belongs to."""

    text: str
    arguments: Sequence[str]


@dataclass(frozen=True, slots=True)
class Case:
    """Command lines that are run one after the other in a folder of their own.

    group    what `ONLY=` names: a language, or the verbs of a subject
    files    to lay into the folder before, by name
    outputs  files and folders that the steps write, by the text that they belong to; those of `exact` as they are
    part     bytes of the parts in which programs are worked through; 0: as a whole
    """

    name: str
    group: str
    steps: Sequence[Step]
    files: Mapping[str, bytes] = field(default_factory=dict)
    outputs: Mapping[str, Sequence[str]] = field(default_factory=dict)
    exact: frozenset[str] = frozenset()
    part: int = 0


class TooLongError(BaseException):
    """A case has had its time."""


class Workplace:
    """The folder in which cases run: `machines`, `examples`, `setup.toml`, `called/FOLDER`, and `case`."""

    def __init__(self, folder: Path, corpus: Path | None) -> None:
        """Lay out what the command lines name."""
        self.folder = folder
        shutil.copytree(HERE / "machines", folder / "machines")
        shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(HERE / "setup.toml", folder)
        if corpus:
            for language in filter(Path.is_dir, corpus.iterdir()):
                (folder / "called" / language.name).mkdir(parents=True)
                for path in sorted(language.iterdir()):
                    (folder / "called" / language.name / called(path.name)).unlink(missing_ok=True)
                    (folder / "called" / language.name / called(path.name)).symlink_to(path)

    def texts(self, case: Case, seconds: float) -> Texts:
        """Run a case; its texts, `LIMIT` for all of them if it needs more CPU time."""
        folder = self.folder / "case"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name, content in case.files.items():
            (folder / name).write_bytes(content)
        names = [*dict.fromkeys(step.text for step in case.steps), *case.outputs, "messages"]
        try:
            with inside(folder), limited(seconds), in_parts(case.part):
                return self._run(case, dict.fromkeys(names, ""))
        except TooLongError:
            return dict.fromkeys(names, LIMIT)

    def _run(self, case: Case, texts: Texts) -> Texts:
        for step in case.steps:
            code, out, err = ncfix(step.arguments)
            texts[step.text] += steady(out, step.text == "motions")
            texts["messages"] += f"$ ncfix {' '.join(step.arguments)}\n{steady(err)}exit code {code}\n"
        for text, paths in case.outputs.items():
            for path in paths:
                texts[text] += written(Path(path), text in case.exact)
        return texts


def called(name: str) -> str:
    """The name that a file of the corpus had: without owner and hash."""
    found = re.fullmatch(r".*?__[0-9a-f]{6}_(.*)", name, re.DOTALL)
    return found[1] if found else name


def ncfix(arguments: Sequence[str]) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command line."""
    from ncfix.cli.main import run

    kept = sys.stdin, sys.stdout, sys.stderr
    out, err = io.BytesIO(), io.BytesIO()
    sys.stdin = io.TextIOWrapper(io.BytesIO())
    sys.stdout, sys.stderr = (io.TextIOWrapper(each, "utf-8", "backslashreplace") for each in (out, err))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            code = run(list(arguments))
        sys.stdout.flush()
        sys.stderr.flush()
        return code, out.getvalue().decode("latin-1"), err.getvalue().decode("latin-1")
    finally:
        sys.stdin, sys.stdout, sys.stderr = kept


def written(path: Path, exact: bool) -> str:
    """The files at a path, each under its name; empty if there is nothing."""
    if path.is_dir():
        return "".join(written(each, exact) for each in sorted(path.iterdir()))
    if not path.exists():
        return ""
    text = path.read_bytes().decode("latin-1")
    return f"-- {path}\n{undated(text) if exact else steady(text)}"


def undated(text: str) -> str:
    """Without versions and dates."""
    for pattern, instead in UNSTEADY:
        text = pattern.sub(instead, text)
    return text


def steady(text: str, motions: bool = False) -> str:
    """A text without what differs from day to day or from one order of sums to another."""

    def rounded(number: re.Match[str]) -> str:
        value = float(number[0])
        found = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".") if motions else f"{value:.{SIGNIFICANT}g}"
        return "0" if found in ("-0", "0") or (not motions and abs(value) < 1e-12) else found

    return NUMBER.sub(rounded, undated(text))


def digest(text: str) -> str:
    """A short digest; `-` of nothing."""
    if text in ("", LIMIT):
        return LATE if text else "-"
    return hashlib.sha256(text.encode("latin-1", "backslashreplace")).hexdigest()[:DIGITS]


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """The working directory."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextmanager
def in_parts(size: int) -> Iterator[None]:
    """The size of parts, where one is given."""
    wanted = {"NCFIX_PART_BYTES": str(size)} if size else {}
    before = {name: os.environ.get(name) for name in wanted}
    os.environ |= wanted
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """So much CPU time; raises TooLongError."""

    def end(signum: int, frame: FrameType | None) -> None:
        raise TooLongError

    signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
