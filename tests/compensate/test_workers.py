"""Several processes at one program: whatever happens to one of them, the run ends, and soon."""

from __future__ import annotations

import io
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import pytest

from compensate.streaming import run
from compensate.test_stream import OPTIONS, SETUP, program, streamed
from conftest import FULL
from ncfix.cli import console
from ncfix.cli.shop.batch import FixJob
from ncfix.cli.streams import Outlet, Source
from ncfix.cli.targets import OutputTarget
from ncfix.compensate import driver, workers
from ncfix.compensate.driver import PartCorrector, ProvedPart, Stream
from ncfix.compensate.following import Task
from ncfix.compensate.parts import PartProof
from ncfix.compensate.workers import Mailbox, WorkerGoneError, connections_between
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import NcfixError, UsageError
from ncfix.machine import Machine, load
from ncfix.text.dialect import get
from ncfix.text.reader import read

SECONDS = 20
"""Far more than any of these takes on a computer that does much else, and far less than for ever."""

pytestmark = [
    pytest.mark.skipif(
        "fork" not in multiprocessing.get_all_start_methods(), reason="what is patched is not inherited"
    ),
    pytest.mark.usefixtures("soon"),
]


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@pytest.fixture
def soon() -> Iterator[None]:
    """Ends a test that hangs."""

    def late(*_: object) -> None:
        raise AssertionError(f"not done within {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def killed(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def killed_in_a_message(connection: Connection, _: object) -> None:
    """After the size of a message, and a little of it."""
    os.write(connection.fileno(), (1 << 20).to_bytes(4, "big") + b"some")
    killed()


def in_another_process(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, instead: Callable[..., Any]) -> None:
    """Have something else done there."""
    own, original = os.getpid(), getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *given: (original if os.getpid() == own else instead)(*given))


@pytest.mark.parametrize("jobs", [2, 3])
@pytest.mark.parametrize(
    ("owner", "name", "instead"),
    [
        (PartCorrector, "_corrected", killed),
        (PartProof, "pass_over", killed),
        (Connection, "send_bytes", killed_in_a_message),
        (workers, "_work", lambda *_: None),
    ],
)
def test_a_process_that_is_gone(
    owner: Any, name: str, instead: Callable[..., Any], jobs: int, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_another_process(monkeypatch, owner, name, instead)
    with pytest.raises(WorkerGoneError):
        streamed(program(5, 400, 0.0), machine, 1000, jobs=jobs)
    assert not multiprocessing.active_children()


def test_what_cannot_be_told(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    in_another_process(monkeypatch, PartCorrector, "_corrected", lambda *_: ProvedPart(b"", lambda: None, 1))  # type: ignore[arg-type]
    with pytest.raises(Exception, match="pickle"):
        streamed(program(5, 400, 0.0), machine, 1000, jobs=2)


@pytest.mark.parametrize("here", [False, True])
def test_what_does_not_arrive(here: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    """What sends messages, in this process or in the others, has no memory."""
    own, send = os.getpid(), Connection.send_bytes

    def full(connection: Connection, data: bytes) -> None:
        if (os.getpid() == own) == here:
            raise MemoryError
        send(connection, data)

    monkeypatch.setattr(Connection, "send_bytes", full)
    with pytest.raises(WorkerGoneError):
        streamed(program(5, 400, 0.0), machine, 1000, jobs=2)


@pytest.mark.parametrize("here", [False, True])
def test_a_fault_of_ncfix_that_keeps_messages_from_being_sent_is_shown_as_such(
    here: bool, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, dumps = os.getpid(), pickle.dumps

    class NowhereMailbox(Mailbox):
        """Sends its messages to a process that there is not."""

        def send(self, kind: str, number: int, what: Any, to: int | None = None) -> None:
            if (os.getpid() == own) == here:
                self.unsent.put((99, dumps((kind, number, what))))
            else:
                super().send(kind, number, what, to)

    monkeypatch.setattr(workers, "Mailbox", NowhereMailbox)
    with pytest.raises(KeyError, match="99") as caught:
        streamed(program(5, 400, 0.0), machine, 1000, jobs=2)
    assert here or "in _send" in caught.value.__notes__[0]
    assert not multiprocessing.active_children()


def test_messages_of_any_size_that_nobody_hears_yet() -> None:
    """Two processes that tell each other more than a connection holds do not wait for each other."""
    connections = connections_between(2, multiprocessing.get_context())
    posts = [Mailbox(process, {1 - process: connections[process, 1 - process]}) for process in range(2)]
    with posts[0].sending(killed), posts[1].sending(killed):
        for mailbox in posts:
            for number in range(3):
                mailbox.send("much", number, bytes(1 << 22))
        for mailbox in posts:
            assert [len(mailbox.wait_for("much", number)) for number in range(3)] == [1 << 22] * 3


def test_what_is_read_of_a_pipe_is_told(machine: Machine) -> None:
    source = program(5, 400, 0.0)
    task = Task(machine, SETUP, OPTIONS, None, "p.ngc", get("linuxcnc"), 1000)
    with TemporaryFile(buffering=0) as kept, TemporaryFile(buffering=0) as out:
        source_of_pipe = Source("-", io.BytesIO(source), kept)
        stream = Stream(task, source_of_pipe.read, Outlet(out, False, bool).put, 3, source_of_pipe.files(out.fileno()))
        stream.run()
        assert out.read() == run(task, source, 1)[0]


def test_where_processes_cannot_be_forked_one_does_it_alone(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = streamed(program(5, 400, 0.0), machine, 1000)
    monkeypatch.setattr(workers, "FORKS", False)
    monkeypatch.delattr(os, "fork")
    assert streamed(program(5, 400, 0.0), machine, 1000, jobs=3) == expected


def test_what_is_said_of_it(machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_another_process(monkeypatch, PartCorrector, "_corrected", killed)
    monkeypatch.setenv("NCFIX_PART_BYTES", "1000")
    source, output = tmp_path / "p.ngc", tmp_path / "out.ngc"
    source.write_bytes(program(5, 400, 0.0))
    with console.keeping() as said:
        outcome = FixJob(machine, Setup(assume_zero=True), "linuxcnc", OPTIONS).outcome(
            OutputTarget(str(source), str(output)), 2
        )
    assert outcome.code != 0
    assert "NCF017" in "".join(said)
    assert not output.exists()


CHANGES = (
    (b"T2 M6", b"T0 M6"),
    (b"G43 H2", b"G49"),
    (b"T2 M6\nG43", b"T0 M6\nG49"),
)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("at", [60, 100, 140, 150] if FULL else [60, 150])
def test_a_tool_that_is_used_within_one_part(change: tuple[bytes, bytes], at: int, machine: Machine) -> None:
    """What is not known of it is told, whichever process has that part."""
    connections = program(5, 200, 0.0).splitlines()
    source = b"\n".join(
        [*connections[:at], change[0], *connections[at : at + 4], change[1], *connections[at + 4 :], b""]
    )
    assert streamed(source, machine, 2000, jobs=2) == streamed(source, machine, 2000)
    zero = dict.fromkeys("XYZBC", 0.0)
    setup = Setup(work_offsets={"G54": zero}, initial=zero, tools={0: Tool(length=50.0)})
    told = []
    for jobs in (1, 2, 3):
        task = Task(machine, setup, OPTIONS, None, "p.ngc", get("linuxcnc"), 2000)
        with pytest.raises(UsageError) as caught:
            Stream(task, io.BytesIO(source).read, lambda _: None, jobs).run()
        told.append([str(message) for message in caught.value.messages])
    with pytest.raises(NcfixError) as expected:
        driver.fix_program(read(source, "p.ngc", "linuxcnc"), machine, setup, OPTIONS)
    assert told == [[str(message) for message in expected.value.messages]] * 3
