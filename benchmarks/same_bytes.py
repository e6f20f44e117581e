"""Corrects programs in all ways there are, compares what comes out, and writes a table into docs/performance.md.

    make same-bytes                    shipped programs, the corpus (`NCFIX_SHARED`, else ../shared), long programs
    make same-bytes MOST=100000        only programs of the corpus up to so many bytes

The ways: columns of numpy and the compiled core; as a whole, and in parts of several sizes; one, two and three
processes; from a file and through a pipe. A program that cannot be corrected must be refused with the same words in
each. Ends with exit code 1 if anything differs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import controls
import programs

from ncfix import core
from ncfix.cli import console
from ncfix.cli.shop.batch import FixJob
from ncfix.cli.targets import OutputTarget
from ncfix.compensate import FixOptions
from ncfix.control.setup import Setup
from ncfix.control.setup_file import load as load_setup
from ncfix.control.trace import NotInPartsError
from ncfix.machine import Machine, load

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "performance.md"
BEGIN, END = "<!-- same bytes: written by `make same-bytes` -->", "<!-- end of same bytes -->"
MACHINE = Path(__file__).with_name("five_axis.toml")
KB, MB = 1 << 10, 1 << 20
FOLDERS = {
    "fanuc": "fanuc",
    "grbl": "iso",
    "heidenhain": "heidenhain",
    "iso": "iso",
    "linuxcnc": "linuxcnc",
    "siemens": "siemens",
}
"""Of the corpus, and the dialect of its programs."""
SHIPPED = {
    "blade": ("iso", "dmu50.toml"),
    "fanuc": ("fanuc", "wCAYFXZSt.toml"),
    "siemens": ("siemens", "wCAYFXZSt.toml"),
    "klartext": ("heidenhain", "dmu50.toml"),
}
"""The first word of the names of shipped programs: their dialect, and the machine that they are for."""


@dataclass(frozen=True, slots=True)
class Way:
    """How a program is corrected: compiled or not, bytes of a part, processes, and through a pipe or not."""

    compiled: bool
    part: int
    jobs: int = 1
    pipe: bool = False

    @property
    def name(self) -> str:
        """In words."""
        size = f"{self.part // MB} MB" if self.part >= MB else f"{self.part // KB} kB"
        words = ["compiled" if self.compiled else "plain", f"parts of {size}", f"{self.jobs} processes"]
        return ", ".join([*words, *(["through a pipe"] if self.pipe else [])])

    def enter(self) -> None:
        """Make it the way that this process goes, and those that it starts."""
        form = "compiled" if self.compiled else "plain"
        os.environ |= {"NCFIX_PART_BYTES": str(self.part), "NCFIX_CORE": form}
        core.use(form)


SHORT_WAYS = (
    Way(False, 64 * MB),
    Way(False, KB),
    Way(False, 16 * KB),
    Way(True, 64 * MB),
    Way(True, KB),
    Way(True, 16 * KB, 2),
    Way(False, 2 * KB, 3),
)
"""For programs of the corpus; the first is what the others are compared with. Most are shorter than 64 kB: parts of
so many bytes would be the whole."""
LONG_WAYS = (
    Way(False, 64 * MB),
    Way(False, 64 * KB),
    Way(False, 64 * KB, 2, True),
    Way(False, 3 * MB // 2, 2),
    Way(True, 64 * MB),
    Way(True, 64 * KB),
    Way(True, MB // 2, 3),
    Way(True, 3 * MB // 2, 1, True),
    Way(True, 3 * MB // 2, 2),
    Way(True, 3 * MB // 2, 2, True),
)


@dataclass(slots=True)
class Row:
    """What there is to say of a group of programs: how many were corrected in all ways alike, refused alike, differ."""

    name: str
    ways: int
    corrected: int = 0
    refused: int = 0
    in_parts: int = 0
    differing: list[str] = field(default_factory=list)

    def cells(self) -> str:
        """As a row of the table."""
        figures = (self.ways, self.corrected, self.in_parts, self.refused, len(self.differing))
        return "| " + " | ".join([self.name, *map(str, figures)]) + " |"


@dataclass(frozen=True, slots=True)
class Case:
    """A program to correct."""

    program: Path
    dialect: str
    machine: Machine
    setup: Setup
    arguments: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a program: the text, and the exit code and all that was said, figures of tip errors left out."""

    text: bytes
    words: tuple[str, ...] = ()

    def is_same(self, other: Found, way: Way) -> bool:
        """Whether another way came to the same; of a pipe only the text is looked at."""
        return self.text == other.text if way.pipe else self == other


def corrected(case: Case, way: Way, folder: Path) -> Found:
    """Correct a program."""
    way.enter()
    if way.pipe:
        return piped(case, way)
    output = folder / "out"
    output.unlink(missing_ok=True)
    options = FixOptions(tolerance_um=5.0, allow_refused=True, force=True)
    job = FixJob(case.machine, case.setup, case.dialect, options)
    with console.keeping() as said:
        outcome = job.outcome(OutputTarget(str(case.program), str(output), force=True), way.jobs)
    text = output.read_bytes() if output.exists() else b""
    words = [line for line in said if "->" not in line and not line.startswith("  tip error")]
    return Found(text, (str(int(outcome.code)), *words))


def piped(case: Case, way: Way) -> Found:
    """The same through a pipe, by the command."""
    command = [sys.executable, "-m", "ncfix", "fix", "-", "-m", str(MACHINE), "--dialect", case.dialect]
    command += ["--allow-refused", "--force", "--tolerance-um", "5", "--jobs", str(way.jobs), *case.arguments]
    with case.program.open("rb") as source:
        done = subprocess.run(command, stdin=source, capture_output=True, check=False)
    return Found(done.stdout)


def compared(name: str, cases: Iterable[Case], ways: Sequence[Way]) -> Row:
    """Correct programs in all ways."""
    row = Row(name, len(ways))
    with tempfile.TemporaryDirectory() as folder:
        for case in cases:
            reference = corrected(case, ways[0], Path(folder))
            parts = 0
            for way in ways[1:]:
                before = Counter(fallen_back)
                found = corrected(case, way, Path(folder))
                parts += case.program.stat().st_size >= 2 * way.part and fallen_back == before
                if not reference.is_same(found, way):
                    row.differing.append(f"{case.program.name}: {way.name}")
            row.corrected += bool(reference.text)
            row.refused += not reference.text
            row.in_parts += parts > 0 and bool(reference.text)
    print(row.cells(), *row.differing, sep="\n", flush=True)
    return row


fallen_back: Counter[str] = Counter()
"""Why programs were taken as a whole after all."""


def watch_those_that_are_not_done_in_parts() -> None:
    """Note each time that a program turns out not to be one for parts."""
    original = NotInPartsError.__init__

    def noting(self: NotInPartsError, *given: object) -> None:
        fallen_back[str(given[0]) if given else ""] += 1
        original(self, *given)

    NotInPartsError.__init__ = noting  # type: ignore[method-assign]


def shipped() -> Iterator[Case]:
    """The programs of the examples."""
    folder = ROOT / "examples" / "programs"
    for path in sorted(folder.iterdir()):
        if path.suffix == ".toml":
            continue
        word = path.name.split("_")[0].split(".")[0]
        dialect, machine = SHIPPED[word]
        setup = load_setup(str(folder / f"{word}.setup.toml"))
        yield Case(path, dialect, load(folder.parent / "machines" / machine), setup)


def corpus(name: str, most: int) -> Iterator[Case]:
    """The programs of a folder of the corpus."""
    shared = Path(os.environ.get("NCFIX_SHARED") or ROOT.parent / "shared")
    machine = load(MACHINE)
    for path in sorted((shared / "corpus" / name).iterdir()):
        if 0 < path.stat().st_size <= most:
            yield Case(path, FOLDERS[name], machine, Setup(assume_zero=True))


def long_programs(blocks: int, folder: Path) -> Iterator[Case]:
    """Programs of the benchmark."""
    zero = dict.fromkeys("XYZBC", 0.0)
    setup = Setup(work_offsets={"G54": zero}, tools={}, assume_zero=True)
    for style in programs.STYLES:
        path = folder / f"{style}.nc"
        programs.write(path, blocks, style)
        yield Case(path, "linuxcnc", load(MACHINE), setup, ("--offset", "G54=0,0,0,0,0", "--assume-zero"))


def others(blocks: int, folder: Path) -> Iterator[Case]:
    """Long programs of other controls."""
    setup = Setup(work_offsets={"G54": dict.fromkeys("XYZBC", 0.0)}, assume_zero=True, no_point="calculator")
    for control in controls.OTHERS:
        for style in control.programs.STYLES:
            path = folder / f"{control.dialect}_{style}"
            control.programs.write(path, blocks, style)
            arguments = ("--assume-zero", *controls.OFFSET, "--no-point", "calculator")
            yield Case(path, control.dialect, load(MACHINE), setup, arguments)


def main() -> int:
    """Compare all, and put the table into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=10 * MB, help="bytes of programs of the corpus")
    parser.add_argument("--blocks", type=int, default=100_000, help="of the long programs")
    given = parser.parse_args()
    watch_those_that_are_not_done_in_parts()
    rows = [compared("shipped programs", shipped(), SHORT_WAYS)]
    with tempfile.TemporaryDirectory() as folder:
        cases = long_programs(given.blocks, Path(folder))
        rows.append(compared(f"benchmark, {given.blocks} blocks", cases, LONG_WAYS))
        cases = others(given.blocks // 5, Path(folder))
        rows.append(compared(f"benchmark of other controls, {given.blocks // 5} blocks", cases, LONG_WAYS))
    rows += [compared(f"corpus, {name}", corpus(name, given.most), SHORT_WAYS) for name in FOLDERS]
    write(rows, given.most)
    return int(any(row.differing for row in rows))


def write(rows: Sequence[Row], most: int) -> None:
    """Put the table into the page."""
    limit = f" (programs up to {most // 1000} kB)" if most < 10 * MB else ""
    text = [f"Ways of `benchmarks/same_bytes.py`{limit}; `in parts`: at least one way corrected it part by part.", ""]
    text += ["| programs | ways | corrected | in parts | refused alike | different bytes or words |"]
    text += ["|---|---|---|---|---|---|", *(row.cells() for row in rows)]
    page = PAGE.read_text()
    head, rest = page.split(BEGIN)
    PAGE.write_text(f"{head}{BEGIN}\n\n" + "\n".join(text) + f"\n\n{END}" + rest.split(END)[1])


if __name__ == "__main__":
    sys.exit(main())
