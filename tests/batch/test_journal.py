"""The journal of a batch: the last word on an output counts, and only as long as nothing has changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ncfix.batch import journal as journals
from ncfix.batch.journal import Journal, JournalRecord, RecordingFinder, announce, digest_of, text_digest
from ncfix.diagnostics import UsageError

ENTRY: dict[str, Any] = {"changed": True, "refused": [], "warnings": []}
"""What is reported of a program, as far as a journal looks at it."""


@pytest.fixture
def output(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_bytes(b"G1 X1\n")
    return path


@pytest.fixture
def record(output: Path) -> JournalRecord:
    digest = digest_of(str(output))
    assert digest
    return JournalRecord("part.nc", "key", digest, {"100": text_digest(b"M99\n"), "200": ""}, ENTRY)


def find(name: str) -> bytes | None:
    return {"100": b"M99\n"}.get(name)


def test_what_was_noted_is_read_again(tmp_path: Path, record: JournalRecord) -> None:
    journal = Journal(str(tmp_path))
    journal.add(JournalRecord("part.nc", "old", "0", entry=ENTRY))
    journal.add(record)
    again = Journal(str(tmp_path))
    assert again.records == journal.records == {"part.nc": record}
    assert set(again.written["part.nc"]) == {"0", record.digest}
    assert again.made("part.nc", "") == set()


@pytest.mark.parametrize("cut", [1, 20, 60])
def test_a_line_that_was_cut_off_spoils_no_other(tmp_path: Path, record: JournalRecord, cut: int) -> None:
    journal = Journal(str(tmp_path))
    journal.add(record)
    whole = Path(journal.path).read_bytes()
    Path(journal.path).write_bytes(whole + whole[:cut])
    journal.add(JournalRecord("other.nc", "key", "0", entry=ENTRY))
    assert set(Journal(str(tmp_path)).records) == {"part.nc", "other.nc"}


@pytest.mark.parametrize("line", [b"[]", b"null", b'{"schema": 2}', b'{"schema": 2, "name": []}', b"\xff\0", b'{"a"'])
def test_what_is_no_line_of_a_journal_does_not_count(tmp_path: Path, record: JournalRecord, line: bytes) -> None:
    journal = Journal(str(tmp_path))
    journal.add(record)
    with open(journal.path, "ab") as handle:
        handle.write(b"\n" + line)
    assert Journal(str(tmp_path)).records == {"part.nc": record}


@pytest.mark.parametrize(
    "changed", [{"entry": {}}, {"entry": {"errors": []}}, {"called": 3}, {"code": "0"}, {"key": None}, {"digest": [1]}]
)
def test_a_record_that_somebody_changed_does_not_count(
    tmp_path: Path, record: JournalRecord, changed: dict[str, Any]
) -> None:
    journal = Journal(str(tmp_path))
    journal.add(record)
    odd = {"schema": journals.SCHEMA, **record.as_dict(), **changed}
    with open(journal.path, "a") as handle:
        handle.write(f"\n{json.dumps(odd)}")
    assert Journal(str(tmp_path)).records == {"part.nc": record}


def test_what_is_announced_counts_as_written(tmp_path: Path) -> None:
    one, other = tmp_path / "one" / "part.nc", tmp_path / "other" / "part.nc"
    announce(Journal(str(tmp_path)).path, "part.nc", "12", str(one))
    assert Journal(str(tmp_path)).made("part.nc", str(one)) == {"12"}
    assert Journal(str(tmp_path)).made("part.nc", str(other)) == set()
    assert Journal(str(tmp_path)).made("else.nc", str(one)) == set()


def test_a_journal_does_not_grow_for_ever(
    tmp_path: Path, record: JournalRecord, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journals, "ROOM_BYTES", 100)
    with Journal.opened(str(tmp_path)) as journal:
        announce(journal.path, "new.nc", "34", "new")
    for _ in range(5):
        with Journal.opened(str(tmp_path)) as journal:
            journal.add(record)
    assert len(Path(journal.path).read_bytes().split(b"\n")) <= 5
    again = Journal(str(tmp_path))
    assert again.records == {"part.nc": record}
    assert again.written == {"part.nc": {record.digest: ""}, "new.nc": {"34": "new"}}


def test_one_batch_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journals, "PATIENCE_S", 0.1)
    with Journal.opened(str(tmp_path)):
        with pytest.raises(UsageError) as caught, Journal.opened(str(tmp_path)):
            pass
        assert caught.value.code == "NCF026"
    with Journal.opened(str(tmp_path)):
        pass


def test_a_record_holds_while_nothing_has_changed(output: Path, record: JournalRecord) -> None:
    assert record.holds("key", str(output), find)
    assert not record.holds("another", str(output), find)
    assert not record.holds("key", str(output), lambda _: None)
    assert not record.holds("key", str(output), lambda _: b"M99\n")
    output.write_bytes(b"G1 X2\n")
    assert not record.holds("key", str(output), find)
    output.unlink()
    assert not record.holds("key", str(output), find)


def test_what_failed_holds_while_nothing_has_changed(output: Path) -> None:
    record = JournalRecord("part.nc", "key", "", {"100": text_digest(b"M99\n")}, code=3, limits="10 s")
    assert record.holds("key", str(output), find, "10 s")
    assert not record.holds("key", str(output), find, "20 s")
    assert not record.holds("key", str(output), lambda _: None, "10 s")
    assert not JournalRecord("part.nc", "", "").holds("", str(output), find)


def test_subprograms_that_were_looked_for_are_noted() -> None:
    noted = RecordingFinder(find)
    assert noted("100") == b"M99\n"
    assert noted("300") is None
    assert noted.called == {"100": text_digest(b"M99\n"), "300": ""}
