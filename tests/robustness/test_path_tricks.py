"""Nothing outside the output folder is ever written, replaced or removed, whatever names and links stand in the way.

Every trick sets a trap in a folder of its own and names a command line. Whatever comes of it, what is foreign and what
is read is afterwards as it was, to the byte, the mode and the last name.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from ncfix import files, outputs
from ncfix.cli.main import run
from ncfix.diagnostics import ExitCode, UsageError

PROGRAM = b"G21 G90 G94\nG0 X10 Y10 Z-1\nG1 X110.000 F600\nX210 Y60\nM2\n"
MACHINE = """
ncfix = 1
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 400] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
effect = [{ name = "EXX", basis = "polynomial", degree = [1], coefficients = [1e-4] }]
"""
FOREIGN = b"nobody's business\n"


class Trick(NamedTuple):
    """A trap, and what walks into it.

    trap   made in an empty folder
    line   what follows `ncfix fix -m machine.toml --assume-zero`
    code   what the message has; empty: the programs are written, and rightly so
    there  outputs that are there afterwards, all but those of the trap
    """

    trap: Callable[[], object]
    line: tuple[str, ...]
    code: str
    there: tuple[str, ...] = ()


def program(path: str) -> None:
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    Path(path).write_bytes(PROGRAM)


def link(path: str, to: str) -> None:
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    os.symlink(to, path)


def both(*parts: Callable[[], object]) -> Callable[[], object]:
    return lambda: [part() for part in parts]


def named(name: str) -> Callable[[], object]:
    return lambda: program(f"in/{name}")


def linked(path: str, to: str, name: str = "deep/part.ngc") -> Callable[[], object]:
    return both(named(name), lambda: link(path, to))


TO_FOLDER = ("in", "-o", "out")
FORCED = (*TO_FOLDER, "--force")
RESUMED = (*TO_FOLDER, "--resume")
ONE = ("part.ngc", "-o")
DEEPER = "a/b/c/part.ngc"

LINKED_FOLDERS = {
    f"{title}, {' '.join(line[3:]) or 'plainly'}": Trick(linked(path, to, name), line, "NCF005")
    for title, path, to, name in (
        ("a folder that leads out", "out/deep", "../foreign", "deep/part.ngc"),
        ("one further down", "out/a/b", "../../foreign", DEEPER),
        ("the last one", "out/a/b/c", "../../../foreign", DEEPER),
        ("a link to a link", "out/deep", "../hop", "deep/part.ngc"),
        ("one that leads to the inputs", "out/deep", "../in/deep", "deep/part.ngc"),
        ("one that leads nowhere", "out/deep", "../foreign/new", "deep/part.ngc"),
        ("one within the folder", "out/deep", "other", "deep/part.ngc"),
        ("one that leads to itself", "out/deep", "deep", "deep/part.ngc"),
    )
    for line in (TO_FOLDER, FORCED, RESUMED)
}

BAD_NAMES = (
    *("CON.nc", "con.nc", "Nul.ngc", "AUX.ngc", "prn.ngc", "COM1.ngc", "lpt9.x.ngc", "CONIN$.ngc", "CLOCK$.ngc"),
    *("COM\u00b2.ngc", "NUL .ngc", "nul/part.ngc", "LPT1.d/part.ngc", "deep./part.ngc", "deep /part.ngc"),
    *(
        "a\\..\\..\\foreign\\part.ngc",
        "C:part.ngc",
        "part.ngc:hidden.ngc",
        "two\nlines.ngc",
        "bell\x07.ngc",
        "esc\x1b[2J.ngc",
    ),
    *("c1\x9b.ngc", "re\rturn.ngc", "del\x7f.ngc"),
)
NAMES = {f"the name {name!r}": Trick(named(name), TO_FOLDER, "NCF023") for name in BAD_NAMES}

FINE_NAMES = (
    "CONTOUR.ngc",
    "O1000 (2).ngc",
    "COM10.ngc",
    "console.ngc",
    "auxiliary.v2.ngc",
    "\u00fcber.ngc",
    "...a.d/p.ngc",
)
FINE = {f"the good name {name!r}": Trick(named(name), TO_FOLDER, "", (f"out/{name}",)) for name in FINE_NAMES[:-1]}

OTHERS = {
    "the output is a link": Trick(
        both(lambda: program("part.ngc"), lambda: link("new.ngc", "foreign/part.ngc")),
        (*ONE, "new.ngc", "--force"),
        "NCF005",
    ),
    "an output in the folder is a link": Trick(linked("out/deep/part.ngc", "../../foreign/part.ngc"), FORCED, "NCF005"),
    "the output is another name of the input": Trick(
        both(lambda: program("part.ngc"), lambda: os.link("part.ngc", "new.ngc")),
        (*ONE, "new.ngc", "--force"),
        "NCF005",
    ),
    "the output is the input by a detour": Trick(
        both(lambda: program("part.ngc"), lambda: os.mkdir("deep")), (*ONE, "deep/../part.ngc", "--force"), "NCF005"
    ),
    "the output is the input by a link": Trick(
        both(named("part.ngc"), lambda: link("way", "in")), ("in/part.ngc", "-o", "way/part.ngc", "--force"), "NCF005"
    ),
    "what is there would be replaced through the folder named": Trick(
        both(lambda: program("part.ngc"), lambda: link("out", "foreign")), (*ONE, "out", "--force"), "NCF005"
    ),
    "what is there would be replaced through a folder on the way": Trick(
        both(lambda: program("part.ngc"), lambda: link("way", "foreign")),
        (*ONE, "way/sub/part.ngc", "--force"),
        "NCF005",
    ),
    "the folder named is a link, and what is there stays": Trick(
        both(lambda: program("part.ngc"), lambda: link("out", "foreign")), (*ONE, "out/part.ngc"), "NCF004"
    ),
    "another name of what is foreign": Trick(
        both(lambda: program("part.ngc"), lambda: os.link("foreign/part.ngc", "new.ngc")),
        (*ONE, "new.ngc", "--force"),
        "",
        ("new.ngc",),
    ),
    "the output is a folder": Trick(both(named("part.ngc"), lambda: os.makedirs("out/part.ngc")), FORCED, "NCF005"),
    "a folder of the output is a file": Trick(
        both(named("deep/part.ngc"), lambda: (os.mkdir("out"), Path("out/deep").write_bytes(b""))), FORCED, "NCF007"
    ),
    "the output is a pipe": Trick(
        both(lambda: program("part.ngc"), lambda: os.mkfifo("new.ngc")), (*ONE, "new.ngc", "--force"), "NCF005"
    ),
    "the output is a device": Trick(lambda: program("part.ngc"), (*ONE, "/dev/full", "--force"), "NCF005"),
    "the journal is a link": Trick(
        both(named("a.ngc"), named("b.ngc"), lambda: link("out/.ncfix-journal.jsonl", "../foreign/part.ngc")),
        FORCED,
        "NCF005",
    ),
    "the journal is another name of what is foreign": Trick(
        both(
            named("a.ngc"),
            named("b.ngc"),
            lambda: (os.mkdir("out"), os.link("foreign/part.ngc", "out/.ncfix-journal.jsonl")),
        ),
        FORCED,
        "NCF005",
    ),
    "names that differ in case": Trick(both(named("Part.ngc"), named("part.ngc")), TO_FOLDER, "NCF006"),
    "folders that differ in case": Trick(both(named("A/part.ngc"), named("a/part.ngc")), TO_FOLDER, "NCF006"),
    "one letter composed in two ways": Trick(both(named("\u00e9.ngc"), named("e\u0301.ngc")), TO_FOLDER, "NCF006"),
    "a name too long": Trick(lambda: program("part.ngc"), (*ONE, "x" * 300 + ".ngc"), "NCF007"),
    "a name too long beside its original": Trick(
        lambda: program("x" * 250 + ".ngc"), ("x" * 250 + ".ngc", "--in-place"), "NCF007"
    ),
    "a program that is a link, in place": Trick(
        lambda: link("part.ngc", "foreign/part.ngc"), ("part.ngc", "--in-place"), "NCF005"
    ),
    "links below a folder, in place": Trick(
        both(
            named("own.ngc"), lambda: link("in/part.ngc", "../foreign/part.ngc"), lambda: link("in/way", "../foreign")
        ),
        ("in", "--in-place"),
        "",
        ("in/own.ngc.orig",),
    ),
    "links below a folder are not followed": Trick(
        both(
            named("own.ngc"), lambda: link("in/part.ngc", "../foreign/part.ngc"), lambda: link("in/way", "../foreign")
        ),
        TO_FOLDER,
        "",
        ("out/own.ngc",),
    ),
    "a pipe among the programs": Trick(
        both(named("own.ngc"), lambda: os.mkfifo("in/pipe.ngc")), TO_FOLDER, "", ("out/own.ngc",)
    ),
    "the original's place is a link": Trick(
        both(lambda: program("part.ngc"), lambda: link("part.ngc.orig", "foreign/part.ngc")),
        ("part.ngc", "--in-place"),
        "NCF008",
    ),
}
TRICKS = {**LINKED_FOLDERS, **NAMES, **FINE, **OTHERS}


def state(folder: Path) -> dict[str, Any]:
    """All that can be told of what is below a folder, links not followed."""
    found: dict[str, Any] = {}
    for path in folder.rglob("*"):
        what = path.lstat()
        content: Any = path.read_bytes() if stat.S_ISREG(what.st_mode) else None
        found[str(path)] = (what.st_mode, what.st_ino, os.readlink(path) if path.is_symlink() else content)
    return found


@pytest.fixture
def ground(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to play in, with a machine and what is foreign."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONUTF8", "1")
    (tmp_path / "foreign" / "sub").mkdir(parents=True)
    for path in ("foreign/part.ngc", "foreign/c.txt", "foreign/sub/part.ngc"):
        Path(path).write_bytes(FOREIGN)
    os.symlink("foreign", "hop")
    Path("machine.toml").write_text(MACHINE)
    return tmp_path


def test_there_are_enough_of_them() -> None:
    assert len(TRICKS) >= 60


@pytest.mark.parametrize(
    ("title", "jobs"),
    [(title, jobs) for title, trick in TRICKS.items() for jobs in ("1", "2")[: 1 + (trick.line[0] == "in")]],
)
def test_nothing_gets_out(title: str, jobs: str, ground: Path, capfd: pytest.CaptureFixture[str]) -> None:
    trick = TRICKS[title]
    trick.trap()
    before = state(ground)
    code = run(["fix", "-m", "machine.toml", "--assume-zero", "--jobs", jobs, *trick.line])
    said, after = capfd.readouterr().err, state(ground)
    changed = {path for path in before if before[path] != after.get(path)}
    fresh = {os.path.relpath(path, ground) for path in after.keys() - before.keys() if Path(path).is_file()}
    assert "NCF000" not in said
    assert trick.code in said
    assert (code == ExitCode.DONE) == (not trick.code)
    assert not {path for path in changed if "foreign" in Path(path).parts}
    if not trick.code:
        assert set(trick.there) <= {os.path.relpath(path, ground) for path in after}
        fresh -= set(trick.there)
        changed -= {str(ground / path.removesuffix(".orig")) for path in trick.there}
    assert not fresh
    assert not changed


def test_a_folder_that_becomes_a_link_meanwhile(ground: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between the look at the way and the writing: what is open stays what it is."""
    checked = outputs.check_output

    def swapped(*given: Any) -> None:
        checked(*given)
        os.rmdir("out/deep")
        os.symlink("../foreign", "out/deep")

    os.makedirs("out/deep")
    monkeypatch.setattr(files, "check_output", swapped)
    before = state(ground / "foreign")
    with pytest.raises(UsageError) as caught:
        files.write_whole("out/deep/part.ngc", b"new", True, "out")
    assert caught.value.code == "NCF005"
    assert state(ground / "foreign") == before


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o644, 0o664, 0o444, 0o755])
@pytest.mark.parametrize("size", ["1", "10", ""])
def test_an_output_has_the_mode_of_its_program(
    mode: int, size: str, ground: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Whether it is read as a whole or in parts, to a folder that is there or not."""
    monkeypatch.setenv("NCFIX_PART_BYTES", size)
    program("part.ngc")
    os.chmod("part.ngc", mode)
    for output in ("new.ngc", "made/new.ngc"):
        assert run(["fix", "-m", "machine.toml", "--assume-zero", "part.ngc", "-o", output]) == ExitCode.DONE
        assert stat.S_IMODE(os.stat(output).st_mode) == mode
    assert run(["fix", "-m", "machine.toml", "--assume-zero", "part.ngc", "--in-place"]) == ExitCode.DONE
    assert [stat.S_IMODE(os.stat(name).st_mode) for name in ("part.ngc", "part.ngc.orig")] == [mode, mode]


@pytest.mark.parametrize("through", ["the folder", "a file"])
def test_tables_stay_in_their_folder(through: str, ground: Path, capfd: pytest.CaptureFixture[str]) -> None:
    Path("foreign/comp.ini").write_bytes(FOREIGN)
    if through == "the folder":
        os.symlink("foreign", "out")
    else:
        os.mkdir("out")
        os.symlink("../foreign/comp.ini", "out/comp.ini")
    before = state(ground)
    assert run(["export", "linuxcnc", "-m", "machine.toml", "-o", "out", "--force"]) == ExitCode.USAGE
    assert "NCF005" in capfd.readouterr().err
    assert state(ground) == before
