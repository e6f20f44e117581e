"""Long programs are corrected while they are read: the same bytes as a short one's, from files and through pipes."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import pytest

from conftest import FULL
from ncfix.compensate.driver import Stream, Streamed
from ncfix.diagnostics import ExitCode

PART = 1000


@pytest.fixture
def long_program(tmp_path: Path) -> Path:
    path = tmp_path / "long.ngc"
    lines = [f"N{k} G1 X{10 + k % 70:.3f} Y{20 + k % 9:.3f} Z5. B{k % 11}. C{k % 13}." for k in range(400)]
    path.write_text(
        "\n".join(["%", "(LONG)", "G21 G90 G94 G54 G17 F900.", "G0 X10. Y20. Z5. B0. C0.", *lines, "M2", "%", ""])
    )
    return path


@pytest.fixture
def fix(root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """`fix(part, arguments)`: in parts of so many bytes."""

    def call(part: int, *arguments: object, stdin: bytes = b"") -> Any:
        monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
        machine = root / "benchmarks" / "five_axis.toml"
        offsets = ("--offset", "G54=0,0,0,0,0", "--tool", "0=0", "--dialect", "linuxcnc")
        return ncfix("fix", *arguments, "-m", machine, *offsets, stdin=stdin)

    return call


def test_a_file(long_program: Path, fix: Any, tmp_path: Path) -> None:
    outputs, parts = [], (1 << 20, PART, 5000)
    for part in parts:
        output = tmp_path / f"{part}.ngc"
        result = fix(part, long_program, "-o", output)
        assert result.code == ExitCode.DONE, result.err
        outputs.append((output.read_bytes(), result.err.replace(str(output), "")))
    assert outputs[0] == outputs[1] == outputs[2]
    assert {path.name for path in tmp_path.iterdir()} == {
        "long.ngc",
        *(f"{part}.ngc" for part in (1 << 20, PART, 5000)),
    }


@pytest.mark.parametrize(("jobs", "part"), [(2, 1700), (3, PART)] if FULL else [(3, PART)])
def test_several_processes(jobs: int, part: int, long_program: Path, fix: Any, tmp_path: Path) -> None:
    alone = fix(part, "-", stdin=long_program.read_bytes())
    assert alone.code == ExitCode.DONE, alone.err
    assert fix(part, "-", "--jobs", jobs, stdin=long_program.read_bytes()).out == alone.out
    assert fix(part, long_program, "--jobs", jobs, "-o", "-").out == alone.out
    assert fix(part, long_program, "--jobs", jobs, "-o", tmp_path / "out.ngc").code == ExitCode.DONE
    assert (tmp_path / "out.ngc").read_bytes() == alone.out


def test_where_processes_cannot_be_forked(long_program: Path, fix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shared_out = fix(PART, long_program, "--jobs", 2, "-o", "-").out
    monkeypatch.setattr("ncfix.compensate.workers.FORKS", False)
    monkeypatch.setattr("multiprocessing.get_context", None)
    assert fix(PART, long_program, "--jobs", 2, "-o", "-").out == shared_out


def test_a_file_that_is_changed_meanwhile(
    long_program: Path, fix: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Stream.run

    def changed(stream: Stream) -> Streamed:
        with long_program.open("ab") as more:
            more.write(b"(more)\n")
        return run(stream)

    monkeypatch.setattr(Stream, "run", changed)
    result = fix(PART, long_program, "-o", tmp_path / "out.ngc")
    assert "NCF002" in result.err
    assert "was changed while it was read" in result.err
    assert not (tmp_path / "out.ngc").exists()


@pytest.mark.parametrize(
    "arguments",
    [("{source}", "-o", "{folder}/out.ngc"), ("{source}", "--jobs", "2", "-o", "{folder}/out.ngc"), ("-", "-o", "-")],
)
def test_no_room_for_what_is_written(
    arguments: tuple[str, ...], long_program: Path, root: Path, tmp_path: Path, ncfix_process: Any
) -> None:
    """The output is named, or the folder for temporary files where it goes to a pipe."""
    given = [argument.format(source=long_program, folder=tmp_path) for argument in arguments]
    result = ncfix_process(
        *("fix", *given, "-m", root / "benchmarks" / "five_axis.toml", "--assume-zero", "--dialect", "linuxcnc"),
        stdin=long_program.read_bytes(),
        env={**os.environ, "NCFIX_PART_BYTES": str(PART)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5 * PART, 5 * PART)),
    )
    assert result.code == ExitCode.USAGE, result.err
    where = gettempdir() if given[0] == "-" else tmp_path / "out.ngc"
    assert f"{where}: NCF007: cannot be written: File too large" in result.err
    assert not (tmp_path / "out.ngc").exists()


def test_a_pipe(long_program: Path, fix: Any) -> None:
    whole = fix(1 << 20, "-", stdin=long_program.read_bytes())
    parts = fix(PART, "-", stdin=long_program.read_bytes())
    assert (whole.code, parts.code) == (ExitCode.DONE, ExitCode.DONE)
    assert whole.out == parts.out != long_program.read_bytes()


def test_zero_is_assumed_further_down(long_program: Path, fix: Any) -> None:
    source = long_program.read_bytes().replace(b"N300 ", b"G55 ")
    whole = fix(1 << 20, "-", "--assume-zero", stdin=source)
    parts = fix(PART, "-", "--assume-zero", stdin=source)
    assert b"assumed zero: work offset G55" in whole.out
    assert whole.out == parts.out


def test_what_cannot_be_done_in_parts_is_done_as_a_whole(long_program: Path, fix: Any, tmp_path: Path) -> None:
    source = long_program.read_bytes().replace(b"M2\n", b"o1 if [1]\nG1 X12.5\no1 endif\nM2\n")
    assert fix(PART, "-", stdin=source).out == fix(1 << 20, "-", stdin=source).out
    long_program.write_bytes(source)
    assert fix(PART, long_program, "-o", tmp_path / "out.ngc").code == ExitCode.DONE
    assert (tmp_path / "out.ngc").read_bytes() == fix(1 << 20, "-", stdin=source).out


@pytest.mark.parametrize(("late", "code"), [(b"ROT Z5", "NCF103"), (b"G96 S200", "")])
def test_what_a_text_is_does_not_depend_on_parts(
    late: bytes, code: str, long_program: Path, fix: Any, tmp_path: Path
) -> None:
    """A word that shows another control stands behind the first part; G96 in one that names no Y yet shows no lathe."""
    lines = long_program.read_bytes().replace(b"G0 X10. Y20. Z5.", b"G0 X10. Z5.").split(b"\n")
    early = b"\n".join([*lines[:3], b"G96 S200", *(b"G1 X%d." % (k % 9) for k in range(300)), *lines[3:]])
    text = early if not code else b"\n".join([*lines[:200], late, *lines[200:]])
    long_program.write_bytes(text)
    for part in (1 << 20, PART):
        result = fix(
            part, long_program, "-o", tmp_path / f"{part}.ngc", "--dialect", "fanuc", "--allow-refused", "--assume-zero"
        )
        assert (code or "-> ") in result.err, result.err
        assert (tmp_path / f"{part}.ngc").exists() == (not code)


def test_a_refusal_writes_nothing(long_program: Path, fix: Any, tmp_path: Path) -> None:
    long_program.write_bytes(long_program.read_bytes().replace(b"N200 G1 X", b"N200 G1 X9"))
    result = fix(PART, long_program, "-o", tmp_path / "out.ngc", "--json")
    assert result.code == ExitCode.REFUSED
    assert [each["line"] for each in result.json()["files"][0]["refused"]][:1] == [205]
    assert not (tmp_path / "out.ngc").exists()


def test_a_pipe_cannot_be_taken_back(long_program: Path, fix: Any) -> None:
    lines = b"".join(b"Z%d.\n" % (5 + k % 3) for k in range(900))  # the arc, out of travel, needs X and Y from before
    source = long_program.read_bytes().replace(b"M2\n", lines + b"G2 X9059. Y23. I4500. J0.\nM2\n")
    result = fix(PART, "-", "--allow-refused", stdin=source)
    assert result.code != ExitCode.DONE
    assert "NCF013" in result.err


def test_writing_begins_before_the_input_ends(long_program: Path, root: Path) -> None:
    command = [sys.executable, "-m", "ncfix", "fix", "-", "-m", str(root / "benchmarks" / "five_axis.toml")]
    command += ["--offset", "G54=0,0,0,0,0", "--tool", "0=0", "--dialect", "linuxcnc"]
    environment = {**os.environ, "NCFIX_PART_BYTES": str(PART)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "env": environment}
    source = long_program.read_bytes()
    with subprocess.Popen(command, **pipes) as process:  # type: ignore[call-overload]
        process.stdin.write(source[:8000])
        process.stdin.flush()
        first = process.stdout.read(500)
        process.stdin.write(source[8000:])
        process.stdin.close()
        rest = process.stdout.read()
    assert process.returncode == ExitCode.DONE
    assert first.startswith(b"%\n(ncfix ")
    assert rest.endswith(b"M2\n%\n")


def test_figures_may_be_left_out(long_program: Path, fix: Any) -> None:
    result = fix(PART, "-", "--no-figures", stdin=long_program.read_bytes())
    assert result.out == fix(PART, "-", stdin=long_program.read_bytes()).out
    assert "tip error" not in result.err
