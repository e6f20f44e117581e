"""The manners of the command line: streams, exit codes, coded messages, quick help."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest

from ncfix import __version__, plugins
from ncfix.__main__ import main as console_script
from ncfix.cli import console, main
from ncfix.diagnostics import ExitCode, Place, RefusedError
from ncfix.plugins import Plugin, Plugins

SLOW_IMPORTS = ("numpy", "scipy", "lark", "rich")

HELP_SECONDS = 0.3
"""The promise of docs/formats.md; measured as processor time, since machines have other things to do."""

ASK_EVERY_VERB = f"""
import sys
from ncfix.cli.main import run
for verb in sys.argv[1:]:
    code = run([*verb.split(), "--help"])
    slow = sorted(name for name in {SLOW_IMPORTS!r} if name in sys.modules)
    if code or slow:
        sys.exit(f"{{verb}}: {{code}}, imports {{slow}}")
"""


def add_command(monkeypatch: pytest.MonkeyPatch, action: Any, name: str = "extra") -> None:
    """Install a plugin with one verb that runs `action`."""
    command = click.Command(name, callback=action, params=[click.Option(["--json"], is_flag=True, expose_value=False)])
    found = Plugins((Plugin("third", "third", things={"commands": {name: command}}),), ())
    monkeypatch.setattr(plugins, "load_plugins", lambda: found)


def test_help_imports_nothing_slow() -> None:
    """Of any verb: in one process, in which imports add up."""
    verbs = ("", *main.VERBS, "machine check", "machine show")
    command = [sys.executable, "-c", ASK_EVERY_VERB, *verbs]
    done = subprocess.run(command, capture_output=True, check=False, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("Usage: ncfix") == len(verbs)


def test_help_answers_at_once(ncfix_process: Any) -> None:
    def seconds() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert ncfix_process("--help").code == 0
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    assert min(seconds() for _ in range(5)) < HELP_SECONDS


def test_help_lists_every_verb_with_a_line(ncfix: Any) -> None:
    out = ncfix("--help").out.decode()
    for verb in main.VERBS:
        assert re.search(rf"^  {verb} +\S", out, re.MULTILINE), verb


def test_version(ncfix: Any) -> None:
    assert ncfix("--version").out.decode() == f"ncfix {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["fux"], "fux"),
        (["explain", "--jsno"], "--json"),
        (["completion", "tcsh"], "tcsh"),
        (["completion"], "SHELL"),
        ([], "ncfix"),
    ],
)
def test_wrong_use_is_exit_2_and_coded(ncfix: Any, arguments: list[str], said: str) -> None:
    result = ncfix(*arguments)
    assert (result.code, result.out) == (ExitCode.USAGE, b"")
    assert said in result.err
    assert "NCF001" in result.err or not arguments


def test_a_coded_error_sets_the_exit_code_and_goes_to_standard_error(
    ncfix: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise RefusedError.of("NCF400", "it will not", Place("part.ngc", 3, 4, "G1 X1"), "make it")

    add_command(monkeypatch, refuse)
    result = ncfix("extra")
    assert (result.code, result.out) == (ExitCode.REFUSED, b"")
    assert result.err == "part.ngc:3:4: NCF400: it will not\n    G1 X1\n       ^\n  hint: make it\n"
    entry = {"code": "NCF400", "text": "it will not", "path": "part.ngc", "line": 3, "column": 4, "hint": "make it"}
    assert ncfix("extra", "--json").json()["errors"] == [entry]


def test_a_bug_is_owned_up_to_with_a_traceback_only_on_request(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    add_command(monkeypatch, lambda: 1 / 0)
    monkeypatch.delenv("NCFIX_DEBUG", raising=False)
    result = ncfix("extra")
    assert (result.code, result.out) == (ExitCode.FAULT, b"")
    assert "NCF000: internal fault of ncfix: ZeroDivisionError" in result.err
    assert "Traceback" not in result.err
    assert "Traceback" in ncfix("--debug", "extra").err
    monkeypatch.setenv("NCFIX_DEBUG", "1")
    assert "Traceback" in ncfix("extra").err


def test_a_bug_is_an_object_for_json_too(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    add_command(monkeypatch, lambda: 1 / 0)
    assert ncfix("extra", "--json").json()["errors"][0]["code"] == "NCF000"


def test_the_value_of_a_verb_is_the_exit_code(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    add_command(monkeypatch, lambda: ExitCode.FINDINGS)
    assert ncfix("extra").code == ExitCode.FINDINGS


def test_a_plugin_cannot_replace_a_built_in_verb(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    add_command(monkeypatch, lambda: 1 / 0, name="explain")
    assert ncfix("explain", "NCF000").code == 0
    result = ncfix("--help")
    assert result.code == 0
    assert "NCF503" in result.err


def test_ctrl_c(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    add_command(monkeypatch, interrupted)
    result = ncfix("extra")
    assert result.code == 128 + signal.SIGINT
    assert "NCF012" in result.err
    assert "Traceback" not in result.err


def test_ctrl_c_while_it_starts(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "main", interrupted)
    with pytest.raises(SystemExit) as ended:
        console_script()
    assert ended.value.code == main.INTERRUPTED
    assert capsys.readouterr().err == "NCF012: interrupted\n"


def test_a_reader_that_goes_away_is_no_fault() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "ncfix", "explain"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, check=False, text=True)
    os.close(writer)
    assert (done.returncode, done.stderr) == (main.BROKEN_PIPE, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("arguments", [["explain"], ["plugins", "--json"], ["completion", "bash"]])
def test_standard_output_on_a_full_disk_is_an_error(arguments: list[str]) -> None:
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "ncfix", *arguments]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, check=False, text=True)
    assert done.returncode == ExitCode.USAGE
    assert done.stderr.startswith("<stdout>: NCF007: cannot be written: No space left on device\n")
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


def test_a_broken_plugin_is_named_in_a_message_and_the_rest_works(ncfix_process: Any, tmp_path: Path) -> None:
    info = tmp_path / "bad-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bad\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[ncfix]\nbad = module_that_is_not_there\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    result = ncfix_process("plugins", "--json", env=environment)
    assert result.code == ExitCode.FINDINGS
    assert "NCF501: plugin 'bad' of bad left out" in result.err
    assert {"gcode", "linuxcnc"} <= {plugin["name"] for plugin in result.json()["plugins"]}
    assert [problem["code"] for problem in result.json()["left_out"]] == ["NCF501"]
    strict = ncfix_process("plugins", env={**environment, "NCFIX_STRICT_PLUGINS": "1"})
    assert strict.code == ExitCode.FAULT
    disabled = ncfix_process("plugins", env={**environment, "NCFIX_DISABLE_PLUGINS": "bad"})
    assert (disabled.code, disabled.err) == (0, "")


def test_json_has_no_nan_and_knows_arrays(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import numpy as np

    def show() -> None:
        console.put_json(
            a=np.array([1.5, np.nan]), b=(np.float64(2), np.int64(3), np.bool_(True)), c={"d": float("inf")}
        )

    add_command(monkeypatch, show)
    assert ncfix("extra").json() == {"schema": 1, "a": [1.5, None], "b": [2.0, 3, True], "c": {"d": None}}


def test_messages_are_plain_where_no_terminal_is_or_no_colour_is_wanted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert console.colour() is None
    monkeypatch.setenv("NO_COLOR", "1")
    assert console.colour() is False
    console.say("part.ngc: NCF002: in bold on a terminal")
    assert capsys.readouterr().err == "part.ngc: NCF002: in bold on a terminal\n"
    console.say(click.style("red", fg="red"))
    assert capsys.readouterr().err == "\\x1b[31mred\\x1b[0m\n"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
@pytest.mark.parametrize("no_color", ["", "1"])
def test_on_a_terminal_tables_are_drawn_and_codes_stand_out(no_color: str) -> None:
    import pty

    def on_terminal(*arguments: str) -> bytes:
        ours, theirs = pty.openpty()
        environment = {**os.environ, "NO_COLOR": no_color, "TERM": "xterm"}
        command = [sys.executable, "-m", "ncfix", *arguments]
        subprocess.run(command, stdout=theirs, stderr=theirs, env=environment, check=False)
        os.close(theirs)
        with open(ours, "rb", buffering=0) as screen:
            return screen.read(65536)

    assert "\N{BOX DRAWINGS LIGHT HORIZONTAL}".encode() in on_terminal("dialects")
    assert (b"\x1b[1mNCF009" in on_terminal("explain", "NCF998")) == (no_color == "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_call_back(ncfix: Any, shell: str) -> None:
    result = ncfix("completion", shell)
    assert result.code == 0
    assert b"_NCFIX_COMPLETE" in result.out


def test_completion_completes_verbs(ncfix_process: Any) -> None:
    environment = {**os.environ, "_NCFIX_COMPLETE": "bash_complete", "COMP_WORDS": "ncfix ex", "COMP_CWORD": "1"}
    assert b"explain" in ncfix_process(env=environment).out
