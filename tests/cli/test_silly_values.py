"""What nobody should type, and scripts do: empty names, misspelled verbs, values of the wrong kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.conftest import Ncfix, Shop

SILLY = [
    (["fiix"], 2, "NCF001: there is no verb 'fiix'; did you mean 'fix'?"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o"], 2, "hint: ncfix fix --help"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", ""], 2, "NCF003: the name of the output is empty"),
    (["fix", "part.ngc", "-m", "", "-o", "a"], 3, "'': NCF300: cannot read the machine file: No such file"),
    (["fix", "", "-m", "machine.toml", "-o", "a"], 3, "'': NCF002: cannot be read: No such file"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--setup", ""], 3, "'': NCF002"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--tool-table", ""], 3, "'': NCF002"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--tool", "-5=1"], 2, "'-5' is neither a tool number"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--tool", "5=1_0"], 2, "'1_0' is not a number"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--offset", "G54=a"], 2, "'' is not a number"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--offset", "G54=1;2"], 2, "'1;2' is not a number"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--tolerance-um", "nan"], 2, "not a number above zero"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--tolerance-um", "1e-9"], 2, "is below 0.01"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a\0b"], 2, "NCF001: an argument contains a NUL character"),
    (["export", "linuxcnc", "-m", "machine.toml", "-o", ""], 2, "NCF003: tables are several files"),
    (["export", "linuxcnc", "-m", "machine.toml", "-o", "-"], 2, "hint: -o FOLDER"),
    (["export", "linuxcnc", "-m", "machine.toml", "-o", "part.ngc"], 2, "part.ngc: NCF007: is not a folder"),
    (["export", "linuxcnc", "-m", "machine.toml", "-o", "t", "--tool-length", "nan"], 2, "is not a length"),
    (["simulate", "-m", "machine.toml", "--plan", "p.csv", "--noise-um", "nan"], 2, "'nan' is not a number"),
    (["simulate", "-m", "machine.toml", "--plan", "p.csv", "--noise-um", "1e300"], 2, "is not in the range"),
    (["calibrate", "a.csv", "-m", "machine.toml", "-o", "c", "--prune", "nan"], 2, "'nan' is not a number"),
    (["calibrate", "part.ngc", "./part.ngc", "-m", "machine.toml", "-o", "c"], 2, "NCF020: is given twice"),
    (["diagnose", "part.ngc", "./part.ngc", "-m", "machine.toml"], 2, "NCF020: is given twice"),
    (["check", "nothing.ngc"], 3, "nothing.ngc: NCF002: cannot be read: No such file"),
    (["machine", "check", "."], 3, "hint: give a file, not a folder"),
    (["fix", "prt.ngc", "-m", "machine.toml", "-o", "a"], 3, "hint: did you mean part.ngc?"),
    (["fix", "parts/part.ngc", "-m", "machine.toml", "-o", "a"], 3, "hint: there is no folder parts"),
    (["fix", "part.ngc", "-m", "machin.toml", "-o", "a"], 3, "hint: did you mean machine.toml?"),
    (["fix", "part.ngc", "-o", "a"], 2, "hint: -m FILE, or name it once for a folder with `ncfix init`"),
    (["fix", "machine.toml", "-m", "machine.toml", "-o", "a"], 3, "NCF103: this is a machine file, not a program"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--setup", "part.ngc"], 3, "looks like an NC program"),
    (["fix", "part.ngc", "-m", "machine.toml", "-o", "a", "--dialect", "SINUMERIK"], 2, "hint: did you mean siemens?"),
    (["export", "klartext", "-m", "machine.toml", "-o", "t"], 2, "hint: did you mean heidenhain?"),
]


@pytest.mark.parametrize(("arguments", "code", "said"), SILLY)
def test_silly_values_are_refused(
    shop: Shop, ncfix: Ncfix, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int, said: str
) -> None:
    monkeypatch.chdir(shop.folder)
    before = {path: path.read_bytes() for path in Path().iterdir()}
    result = ncfix(*arguments)
    assert said in result.err
    assert result.code == code
    assert "NCF000" not in result.err
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


def test_a_program_for_another_control_is_remarked_on(shop: Shop, ncfix: Ncfix) -> None:
    shop.machine.write_text('control = "haas"\n' + shop.machine.read_text())
    klartext, fanuc = shop.folder / "plate.h", shop.folder / "part.fnc"
    klartext.write_text("BEGIN PGM P MM\nL X+10 Y+10 Z-1 R0 FMAX\nL X+110 F600\nEND PGM P MM\n")
    fanuc.write_bytes(b"%\nO1 (CORNER)\n" + shop.program.read_bytes())
    for program, more, remarks in (
        (klartext, (), 1),
        (klartext, ("--dialect", "heidenhain"), 0),
        (fanuc, ("--no-point", "calculator"), 0),
    ):
        result = ncfix("fix", program, "-m", shop.machine, "-o", "-", "--assume-zero", *more)
        assert result.code == 0
        said = "NCF106: this is Heidenhain Klartext, and the control of the machine file is haas"
        assert result.err.count(said) == remarks


def test_a_size_of_parts_that_is_none(shop: Shop, ncfix: Ncfix, monkeypatch: pytest.MonkeyPatch) -> None:
    for said in ("abc", "0", "-5"):
        monkeypatch.setenv("NCFIX_PART_BYTES", said)
        result = ncfix("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc", "--assume-zero")
        assert (result.code, "NCFIX_PART_BYTES" in result.err) == (2, True)


def test_every_message_in_json_has_a_hint(shop: Shop, ncfix: Ncfix) -> None:
    shop.machine.write_text("x = 1\n")
    result = ncfix("machine", "check", shop.machine, "--json")
    assert result.code == 3
    assert all(message["hint"] for message in result.json()["errors"])


def test_wrong_use_is_said_in_json_too(ncfix: Ncfix) -> None:
    result = ncfix("fix", "--json")
    assert result.code == 2
    assert [error["code"] for error in result.json()["errors"]] == ["NCF001"]


def test_a_fault_ends_one_program_and_not_the_others(shop: Shop, ncfix: Ncfix, monkeypatch: pytest.MonkeyPatch) -> None:
    from ncfix.cli.shop import batch

    other = shop.folder / "other.ngc"
    other.write_bytes(shop.program.read_bytes())
    whole = batch.FixJob._whole

    def broken(self: batch.FixJob, source: batch.Source, *rest: object) -> object:
        if source.path.endswith("part.ngc"):
            raise KeyError("nobody foresaw this")
        return whole(self, source, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(batch.FixJob, "_whole", broken)
    arguments = ("fix", shop.program, other, "-m", shop.machine, "-o", shop.folder / "out", "--assume-zero", "--json")
    result = ncfix(*arguments)
    assert result.code == 5
    assert [file["output"] is None for file in result.json()["files"]] == [True, False]
    assert "Traceback" not in result.err
    assert "Traceback" in ncfix("--debug", *arguments, "--force").err
    again = ncfix("--debug", *arguments, "--resume")
    assert "resumed" not in again.json()["files"][0]
    assert "Traceback" in again.err
    monkeypatch.undo()
    assert ncfix(*arguments, "--resume").code == 0


def test_tables_are_written_all_or_not_at_all(shop: Shop, ncfix: Ncfix, monkeypatch: pytest.MonkeyPatch) -> None:
    from ncfix import files

    write, left = files.write_whole, [1, 2]

    def full(path: str, data: bytes, *more: object) -> None:
        if not left:
            raise files.unwritable(path, OSError(28, "No space left on device"))
        left.pop()
        write(path, data, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(files, "write_whole", full)
    result = ncfix("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "tables")
    assert (result.code, "NCF007" in result.err, left) == (2, True, [])
    assert list((shop.folder / "tables").iterdir()) == []


@pytest.mark.parametrize(
    ("offset", "code"), [("0,0,60,0,10", 2), ("0,0,60,0,10,0", 2), ("0,0,60,0,0,10", 0), ("Z60,C10", 0)]
)
def test_a_work_offset_in_the_order_of_the_axes_of_a_machine_is_refused(
    offset: str, code: int, ncfix: Ncfix, root: Path
) -> None:
    """X Y Z A C of a machine without B: the fifth number is B. Six may be three with decimal commas."""
    guide = root / "examples" / "guide"
    given = ("--setup", guide / "setup.toml", "--offset", f"G54={offset}")
    result = ncfix("check", guide / "shop" / "bracket.nc", "-m", guide / "mill.toml", *given)
    assert result.code == code
    assert ("NCF384: work offset G54: B is 10" in result.err) == (code == 2)
