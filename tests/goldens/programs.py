"""The cases with programs: the corpus, the examples, and the generated ones; machines, strategies and ways in rotation.

Every program is followed, corrected and verified on one machine by one strategy; a second case takes another machine,
the next strategy, and another way: written out flat, in parts, with the dialect found out, with rapids split. Which
ones is a matter of the program's name alone, so that a further program changes no other case.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

from goldens.case import HERE, ROOT, Case, Step, called

ARCHIVE = HERE / "programs.jsonl.xz"
GROUPS = {"haas": "fanuc", "mitsubishi": "fanuc", "grbl": "iso"}
"""Dialects and folders of the corpus that belong to another group than that of their name."""
MACHINES = {"": ("three", "table", "head", "play"), "A": ("table",), "AC": ("table",), "BC": ("play", "head")}
"""On which machines programs run, by the rotary axes that they name."""
STRATEGIES = ("rotary-then-linear", "position", "full")
ZERO = ("--assume-zero", "--no-point", "calculator")
SHIPPED = {"blade": "wCBXFZYSt", "fanuc": "wCAYFXZSt", "siemens": "wCAYFXZSt", "klartext": "dmu50"}
"""The first word of the names of shipped programs, and the machine that they are for."""
SECOND = 2
"""One of so many programs has a second case."""
LONG = 100_000
"""Bytes from which on a program has no second case but in parts."""


class Way(NamedTuple):
    """How a program is corrected: its name, options of `fix`, of all verbs, and whether its dialect is named."""

    name: str
    of_fix: Sequence[str] = ()
    of_all: Sequence[str] = ()
    named: bool = True


WHOLE, PARTS = Way("whole"), Way("parts")
WAYS = (
    Way("flat", ("--flatten",)),
    PARTS,
    Way("flat", ("--flatten",)),
    PARTS,
    Way("found", named=False),
    Way("rapids", ("--split-rapids", "--block-numbers", "none")),
    Way("on", of_all=("--block-skip", "on")),
    Way("off", of_all=("--block-skip", "off")),
)


class Program(NamedTuple):
    """A program, and what the verbs are told of it; several machines are for rotation."""

    name: str
    group: str
    dialect: str
    file: str
    text: bytes
    machines: Sequence[str]
    options: Sequence[str]
    tolerance: str


def cases(corpus: Path | None) -> Iterator[Case]:
    """All cases of all programs."""
    for program in (*shipped(), *generated(), *(of_corpus(corpus) if corpus else ())):
        yield from both(program)


def both(program: Program) -> Iterator[Case]:
    """The cases of a program."""
    chance = crc32(program.name.encode())
    count = len(program.machines)
    yield case(program, program.machines[chance % count], STRATEGIES[chance // 4 % 3], WHOLE)
    if chance // 96 % SECOND:
        return
    way = WAYS[chance // 12 % len(WAYS)]
    if way.name in ("on", "off") and b"/" not in program.text:
        way = WAYS[chance // 12 % 4]
    if way is PARTS and len(program.text) < 1200:
        way = WAYS[0]
    if len(program.text) > LONG:
        way = PARTS
    yield case(program, program.machines[(chance + 1) % count], STRATEGIES[(chance // 4 + 1) % 3], way)


def case(program: Program, machine: str, strategy: str, way: Way) -> Case:
    """The case of a program on a machine: followed, corrected, verified, and checked or simulated."""
    path = f"../examples/machines/{machine}.toml" if machine in SHIPPED.values() else f"../machines/{machine}.toml"
    told = ["-m", path, *(("--dialect", program.dialect) if way.named else ()), *program.options, *way.of_all, "--json"]
    fixed = f"fixed{Path(program.file).suffix}"
    limits = ("--tolerance-um", program.tolerance)
    fix = ["fix", program.file, "-o", fixed, "--strategy", strategy, "--jobs", "1", "--allow-refused", "--force"]
    steps = [
        Step("motions", ["trace", program.file, *told]),
        Step("report", [*fix, *limits, *way.of_fix, *told]),
        Step("verify", ["verify", program.file, fixed, *limits, *told]),
    ]
    if way.name not in ("whole", "flat"):
        steps.append(Step("verify", ["simulate", "--program", program.file, *told]))
    if way.name == "flat":
        steps[0] = Step("motions", ["check", program.file, *told])
    return Case(
        name=f"{program.name}@{machine}.{strategy.partition('-')[0]}.{way.name}",
        group=program.group,
        steps=steps,
        files={program.file: program.text},
        outputs={"output": [fixed]},
        exact=frozenset(["output"]),
        part=max(500, min(len(program.text) // 4, 1 << 14)) if way is PARTS else 0,
    )


def generated() -> Iterator[Program]:
    """Those of the archive."""
    with lzma.open(ARCHIVE, "rt", encoding="utf-8") as lines:
        for line in lines:
            each: Mapping[str, str] = json.loads(line)
            dialect = each["dialect"]
            group = GROUPS.get(dialect, dialect)
            options = ["--setup", "../setup.toml", *ZERO]
            machines = MACHINES[each["rotary"]]
            file = "part.h" if dialect == "heidenhain" else "part.nc"
            yield Program(each["name"], group, dialect, file, each["text"].encode(), machines, options, "1")


def shipped() -> Iterator[Program]:
    """Those of the examples, on the machines that they are for."""
    folder = ROOT / "examples" / "programs"
    dialects = {"blade": "iso", "klartext": "heidenhain"}
    for path in sorted(folder.iterdir()):
        word = path.name.split("_")[0].split(".")[0]
        if path.suffix != ".toml":
            options = ["--setup", f"../examples/programs/{word}.setup.toml"]
            dialect = dialects.get(word, word)
            machines = [SHIPPED[word]]
            yield Program(
                f"examples/{path.name}", dialect, dialect, path.name, path.read_bytes(), machines, options, "1"
            )


def of_corpus(corpus: Path) -> Iterator[Program]:
    """Those of the corpus; subprograms are found under the names by which programs call them."""
    for folder in sorted(filter(Path.is_dir, corpus.iterdir())):
        dialect = GROUPS.get(folder.name, folder.name)
        options = ["--subprograms", f"../called/{folder.name}", *ZERO]
        for path in sorted(folder.iterdir()):
            name = f"corpus/{folder.name}/{path.name.replace(' ', '_')}"
            text = path.read_bytes()
            yield Program(name, dialect, dialect, called(path.name), text, MACHINES[""], options, "5")
