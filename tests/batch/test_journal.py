"""The journal of a batch: the last word on an output counts, and only as long as nothing has changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.batch.work import Journal, JournalRecord, RecordingFinder, digest_of, text_digest


@pytest.fixture
def output(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_bytes(b"G1 X1\n")
    return path


@pytest.fixture
def record(output: Path) -> JournalRecord:
    digest = digest_of(str(output))
    assert digest
    return JournalRecord("part.nc", "key", digest, {"100": text_digest(b"M99\n"), "200": ""}, {"output": str(output)})


def find(name: str) -> bytes | None:
    return {"100": b"M99\n"}.get(name)


def test_what_was_noted_is_read_again(tmp_path: Path, record: JournalRecord) -> None:
    journal = Journal(str(tmp_path))
    journal.add(JournalRecord("part.nc", "old", "0"))
    journal.add(record)
    assert journal.records() == {"part.nc": record}
    journal.finish()
    assert not Path(journal.path).exists()
    assert journal.records() == {}


@pytest.mark.parametrize("cut", [1, 20, 60])
def test_a_line_that_was_cut_off_spoils_no_other(tmp_path: Path, record: JournalRecord, cut: int) -> None:
    journal = Journal(str(tmp_path))
    journal.add(record)
    whole = Path(journal.path).read_bytes()
    Path(journal.path).write_bytes(whole + whole[:cut])
    journal.add(JournalRecord("other.nc", "key", "0"))
    assert set(journal.records()) == {"part.nc", "other.nc"}


def test_a_record_holds_while_nothing_has_changed(output: Path, record: JournalRecord) -> None:
    assert record.holds("key", str(output), find)
    assert not record.holds("another", str(output), find)
    assert not record.holds("key", str(output), lambda _: None)
    assert not record.holds("key", str(output), lambda _: b"M99\n")
    output.write_bytes(b"G1 X2\n")
    assert not record.holds("key", str(output), find)
    output.unlink()
    assert not record.holds("key", str(output), find)


def test_subprograms_that_were_looked_for_are_noted() -> None:
    noted = RecordingFinder(find)
    assert noted("100") == b"M99\n"
    assert noted("300") is None
    assert noted.called == {"100": text_digest(b"M99\n"), "300": ""}
