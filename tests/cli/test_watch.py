"""`ncfix watch`: programs that come into a folder are corrected when they are complete."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

from cli.conftest import PROGRAM
from conftest import PATIENCE_S, require_module, until
from ncfix.diagnostics import ExitCode

SETTLE_S = 1.5
"""Much longer than the breaks in which a program is written here, on a loaded computer too."""


@pytest.fixture(params=["polling", "told"])
def watching(request: Any, shop: Any) -> Iterator[subprocess.Popen[str]]:
    if request.param == "told":
        require_module("watchfiles")
    (shop.folder / "in").mkdir()
    command = ["watch", "in", "out", "-m", "machine.toml", "--assume-zero", "--status", "s.html"]
    command += ["--settle-s", str(SETTLE_S)]
    with (shop.folder / "said.txt").open("w") as said:
        running = subprocess.Popen(
            [sys.executable, "-m", "ncfix", *command, *(["--poll-s", "0.1"] if request.param == "polling" else [])],
            cwd=shop.folder,
            stderr=said,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a run in the background ignores it
        )
    yield running
    if running.poll() is None:
        running.kill()
    running.wait()


def test_programs_are_corrected_as_they_come(watching: subprocess.Popen[str], shop: Any) -> None:
    source, output, page = (shop.folder / name for name in ("in/a/part.ngc", "out/a/part.ngc", "s.html"))
    said = shop.folder / "said.txt"
    until(page.exists)
    assert "no program yet" in page.read_text()
    source.parent.mkdir()
    with source.open("wb") as handle:
        for piece in (PROGRAM[:30], PROGRAM[30:]):
            handle.write(piece)
            handle.flush()
            time.sleep(SETTLE_S / 5)
            assert not output.exists()
    until(output.exists)
    assert b"X109.989" in output.read_bytes()
    source.write_bytes(PROGRAM.replace(b"X110.000", b"X120.000"))
    until(lambda: b"X119.988" in output.read_bytes())
    (shop.folder / "in/bad.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    until(lambda: "bad.ngc" in page.read_text())
    text = page.read_text()
    assert "1 failed, 2 written" in text
    assert "NCF1" in text
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "2e-4"))
    until(lambda: b"X119.976" in output.read_bytes())
    until(lambda: said.read_text().count("in/a/part.ngc -> out/a/part.ngc\n") == 3)
    os.kill(watching.pid, signal.SIGINT)
    assert watching.wait(timeout=PATIENCE_S) == ExitCode.UNREADABLE
    assert said.read_text().endswith("stopped\n")


def test_once(ncfix: Any, shop: Any) -> None:
    (shop.folder / "in").mkdir()
    (shop.folder / "in/part.ngc").write_bytes(PROGRAM)
    command = ("watch", shop.folder / "in", shop.folder / "out", "-m", shop.machine, "--settle-s", "0.1", "--once")
    assert ncfix(*command).code == ExitCode.USAGE
    assert ncfix(*command, "--assume-zero", "--poll-s", "0.05").code == ExitCode.DONE
    assert b"X109.989" in (shop.folder / "out/part.ngc").read_bytes()
    assert "->" not in ncfix(*command, "--assume-zero").err


def test_with_a_project(ncfix: Any, shop: Any) -> None:
    (shop.folder / "in").mkdir()
    (shop.folder / "in/part.ngc").write_bytes(PROGRAM)
    (shop.folder / "ncfix.toml").write_text('machine = "machine.toml"\n[options]\nassume_zero = true\n')
    result = ncfix("watch", shop.folder / "in", shop.folder / "out", "--settle-s", "0.1", "--once")
    assert result.code == ExitCode.DONE, result.err
    assert (shop.folder / "out/part.ngc").exists()


def test_a_machine_that_is_wrong_for_a_while(ncfix: Any, shop: Any) -> None:
    (shop.folder / "in").mkdir()
    (shop.folder / "in/part.ngc").write_bytes(PROGRAM)
    shop.machine.write_text("nonsense")
    page = shop.folder / "s.html"
    command = ("watch", shop.folder / "in", shop.folder / "out", "-m", shop.machine, "--settle-s", "0.1", "--once")
    result = ncfix(*command, "--status", page)
    assert result.code == ExitCode.UNREADABLE
    assert "NCF30" in page.read_text()


def test_what_is_no_folder(ncfix: Any, shop: Any) -> None:
    result = ncfix("watch", shop.folder / "none", shop.folder / "out", "-m", shop.machine)
    assert result.code == ExitCode.USAGE
    assert "NCF014" in result.err


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("in/part.ngc", "NCF018"),
        ("machine.toml", "NCF005"),
        ("precious.html", "NCF004"),
        ("link.html", "NCF005"),
        ("new.toml", "NCF018"),
        ("none/nul\n.html", "NCF023"),
    ],
)
def test_the_page_takes_the_place_of_no_other_file(ncfix: Any, shop: Any, name: str, code: str) -> None:
    (shop.folder / "in").mkdir()
    (shop.folder / "in/part.ngc").write_bytes(PROGRAM)
    (shop.folder / "precious.html").write_text("<p>figures of last year")
    (shop.folder / "link.html").symlink_to("new.html")
    before = {path: path.read_bytes() for path in shop.folder.rglob("*") if path.is_file()}
    command = ("watch", shop.folder / "in", shop.folder / "out", "-m", shop.machine, "--assume-zero", "--once")
    result = ncfix(*command, "--status", shop.folder / name)
    assert (result.code, code in result.err) == (ExitCode.USAGE, True), result.err
    assert {path: path.read_bytes() for path in shop.folder.rglob("*") if path.is_file()} == before


def test_a_page_that_cannot_be_written_stops_nothing(
    ncfix: Any, shop: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    from ncfix.cli.shop.watch import StatusPage

    (shop.folder / "in").mkdir()
    (shop.folder / "in/part.ngc").write_bytes(PROGRAM)
    folder, add = shop.folder / "pages", StatusPage.add

    def lose(self: StatusPage, entry: Any) -> None:
        folder.rename(tmp_path / "gone")
        folder.write_text("")
        add(self, entry)

    monkeypatch.setattr(StatusPage, "add", lose)
    command = ("watch", shop.folder / "in", shop.folder / "out", "-m", shop.machine, "--assume-zero", "--once")
    result = ncfix(*command, "--settle-s", "0.1", "--status", folder / "s.html")
    assert result.code == ExitCode.DONE
    assert result.err.count("s.html: NCF0") == 1
    assert (shop.folder / "out/part.ngc").exists()


def test_a_setup_that_is_not_there_yet(shop: Any) -> None:
    from ncfix.batch import watching

    require_module("watchfiles")
    (shop.folder / "in").mkdir()
    setup = shop.folder / "later/setup.toml"
    looks = watching.moments(str(shop.folder / "in"), [str(setup)], 0.1, None)
    assert [next(looks), next(looks)] == [None, None]
    time.sleep(0.1)
    setup.parent.mkdir()
    setup.write_text("assume_zero = true\n")
    assert next(looks) is None
    looks.close()


def test_programs_do_not_go_where_they_come_from(ncfix: Any, shop: Any) -> None:
    (shop.folder / "in").mkdir()
    result = ncfix("watch", shop.folder / "in", f"{shop.folder}/in/", "-m", shop.machine, "--once")
    assert (result.code, "NCF005" in result.err) == (ExitCode.USAGE, True)
    for nowhere in ("", "-"):
        result = ncfix("watch", shop.folder / "in", nowhere, "-m", shop.machine, "--once")
        assert (result.code, "NCF003" in result.err) == (ExitCode.USAGE, True)


def test_nothing_of_a_name_steers_the_page(shop: Any) -> None:
    from ncfix.cli.shop.watch import StatusPage

    page = StatusPage(None)
    error = {"code": "NCF100", "text": "<script>", "line": 1}
    page.add({"path": "<b>\x1b.ngc", "output": None, "errors": [error]})
    text = page.text()
    assert "<script>" not in text
    assert "&lt;b&gt;\\x1b.ngc" in text
