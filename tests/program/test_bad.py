"""Programs that cannot be read, and exactly what is said about them.

Each file under `bad/<dialect>/` is a program; `<name>.expected` beside it is the message.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.diagnostics import ExitCode, SourceError, UsageError
from ncfix.text.codes import CODES
from ncfix.text.reader import read

BAD = Path(__file__).parent / "bad"
PROGRAMS = sorted(path for path in BAD.glob("*/*") if path.suffix != ".expected")


def refusal(source: bytes, path: str = "part.nc", dialect: str | None = None) -> SourceError:
    with pytest.raises(SourceError) as caught:
        read(source, path, dialect)
    return caught.value


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_the_message_is_exact(program: Path) -> None:
    error = refusal(program.read_bytes(), program.name, program.parent.name)
    assert f"{error}\n" == program.with_suffix(".expected").read_text(encoding="utf-8")
    assert error.code in CODES
    assert error.exit_code is ExitCode.UNREADABLE


def test_there_are_enough_of_them() -> None:
    assert len(PROGRAMS) >= 60


@pytest.mark.parametrize("mark", [b"\xff\xfe", b"\xfe\xff"])
def test_utf_16_is_no_program(mark: bytes) -> None:
    assert refusal(mark + "G0 X1\n".encode("utf-16-le")).code == "NCF101"


def test_a_zero_byte_is_named_with_its_place() -> None:
    error = refusal(b"G0 X1\nG1 \0\n")
    assert str(error) == "part.nc:2:4: NCF101: there is a zero byte in the file"


def test_a_line_longer_than_the_control_takes() -> None:
    limit = 252
    assert len(read(b";" * limit + b"\nM2\n", dialect="linuxcnc")) == 2
    error = refusal(b"M0\n" + b";" * (limit + 1) + b"\nM2\n", dialect="linuxcnc")
    assert (error.code, error.messages[0].place.line) == ("NCF105", 2)  # type: ignore[union-attr]


def test_a_fault_before_a_line_that_is_too_long_comes_first() -> None:
    assert refusal(b"G0 X1.2.3\n(" + b"-" * 100_000 + b")\n").code == "NCF115"


def test_an_unknown_dialect_gets_a_suggestion() -> None:
    with pytest.raises(UsageError) as caught:
        read(b"M2\n", dialect="linuxncn")
    assert str(caught.value) == "NCF104: no dialect 'linuxncn'\n  hint: did you mean linuxcnc?"
