"""What shells complete: verbs, options, files wherever a file is named, dialects, controls, codes."""

from __future__ import annotations

import os
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import click
import pytest

from conftest import missing
from ncfix.cli.main import VERBS, cli, run

FILES = re.compile(r"\b(FILE|DIR|TABLEDIR|PROGRAM|MACHINE)\b")
NAMED = {"file", "program", "original", "fixed", "measured", "programs", "sources", "folder", "output"}


def params() -> list[Any]:
    """Every option and argument of every verb, below its words."""
    found = []

    def walk(words: str, command: click.Command) -> None:
        found.extend(pytest.param(words, param, id=f"{words} {param.name}") for param in command.params)
        if isinstance(command, click.Group):
            for name in command.list_commands(click.Context(command)):
                inner = command.get_command(click.Context(command), name)
                assert inner is not None
                walk(f"{words} {name}", inner)

    for verb in VERBS:
        command = cli.get_command(click.Context(cli), verb)
        assert command is not None
        walk(verb, command)
    return found


@pytest.mark.parametrize(("words", "param"), params())
def test_whatever_is_a_file_is_completed_by_the_shell(words: str, param: click.Parameter) -> None:
    context = click.Context(click.Command(words))
    kinds = {item.type for item in param.shell_complete(context, "pa")}
    said = param.metavar or ""
    is_file = bool(FILES.search(said)) if isinstance(param, click.Option) else param.name in NAMED
    assert bool(kinds & {"file", "dir"}) == is_file
    assert param.name != "measured" or kinds == {"file"}


def asking(shell: str, *words: str) -> dict[str, str]:
    """What the script of a shell sets in the environment; the last word is to be completed."""
    place = words[-1] if shell == "fish" else str(len(words) - 1)
    return {"COMP_WORDS": " ".join(words), "COMP_CWORD": place, "_NCFIX_COMPLETE": f"{shell}_complete"}


def completed(shell: str, *words: str) -> list[str]:
    """The answer of `ncfix` to the script of a shell."""
    done = subprocess.run(
        [sys.executable, "-c", "import sys; sys.argv[0] = 'ncfix'; from ncfix.__main__ import main; main()"],
        env={**os.environ, **asking(shell, *words)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.stderr == ""
    return done.stdout.splitlines()


ANSWERS = {"bash": "file,pa", "zsh": "file", "fish": "file,pa"}


@pytest.mark.parametrize("shell", ANSWERS)
def test_files_in_the_words_of_each_shell(shell: str) -> None:
    assert completed(shell, "ncfix", "fix", "pa")[0] == ANSWERS[shell]
    assert completed(shell, "ncfix", "fix", "a.nc", "-m", "pa")[0] == ANSWERS[shell]


@pytest.mark.parametrize(
    ("words", "there"),
    [
        (("ncfix", "ma"), {"machine"}),
        (("ncfix", "fix", "--to"), {"--tolerance-um", "--tool", "--tool-table"}),
        (("ncfix", "fix", "--dialect", "h"), {"heidenhain", "haas"}),
        (("ncfix", "dialects", "lin"), {"linuxcnc"}),
        (("ncfix", "explain", "NCF00"), {f"NCF00{n}" for n in range(10)}),
        (("ncfix", "explain", "ncf023"), {"NCF023"}),
        (("ncfix", "export", "lin"), {"linuxcnc"}),
        (("ncfix", "emulate", "fan"), {"fanuc"}),
        (("ncfix", "fix", "--strategy", "f"), {"full"}),
        (("ncfix", "fix", "--executor", "p"), {"processes"}),
        (("ncfix", "completion", "z"), {"zsh"}),
    ],
)
def test_names_of_what_there_is(
    words: tuple[str, ...], there: set[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, value in asking("bash", *words).items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit):
        run([])
    found = {line.removeprefix("plain,").split("\t")[0] for line in capsys.readouterr().out.splitlines()}
    assert there <= found
    assert all(name.lower().startswith(words[-1].lower()) for name in found)


SHELLS = {
    "bash": (["bash", "--norc", "--noprofile", "-i"], 'eval "$(ncfix completion bash)"'),
    "zsh": (["zsh", "-f", "-i"], 'autoload -Uz compinit && compinit -u -D; eval "$(ncfix completion zsh)"'),
    "fish": (["fish", "--no-config", "-i"], "ncfix completion fish | source"),
}


@pytest.mark.parametrize("shell", SHELLS)
def test_in_the_shell_itself(shell: str, tmp_path: Path) -> None:
    """On a terminal: a few letters and a tab make the name of a file, that of a dialect and a code."""
    pty = pytest.importorskip("pty")
    command, load = SHELLS[shell]
    if not shutil.which(shell):
        missing(f"{shell} is not installed", "NCFIX_REQUIRE_TOOLS")
    (tmp_path / "particular.ngc").touch()
    run = tmp_path / "bin" / "ncfix"
    run.parent.mkdir()
    code = "import sys; sys.argv[0] = 'ncfix'; from ncfix.__main__ import main; main()"
    run.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{code}" "$@"\n')
    run.chmod(0o755)
    process, master = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        path = f"{run.parent}{os.pathsep}{os.environ['PATH']}"
        home = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path), "XDG_DATA_HOME": str(tmp_path)}
        os.execvpe(command[0], command, {**os.environ, **home, "PATH": path, "TERM": "xterm", "PS1": "> "})
    try:
        talk(master, f"{load}; echo rea''dy\r", "ready")
        talk(master, "ncfix check part\t", "particular.ngc")
        talk(master, "\x15ncfix check --dialect siem\t", "siemens")
        talk(master, "\x15ncfix explain NCF02\t\t", "NCF023")
    finally:
        os.kill(process, 9)
        os.close(master)
        os.waitpid(process, 0)


def talk(terminal: int, words: str, answer: str) -> None:
    """Type something, and wait for what comes."""
    os.write(terminal, words.encode())
    heard, until = "", time.monotonic() + 60
    while answer not in heard:
        assert time.monotonic() < until, heard
        if select.select([terminal], [], [], 1)[0]:
            heard += os.read(terminal, 1 << 16).decode(errors="replace")


def test_a_shell_that_is_not_known_or_not_named(ncfix: Any) -> None:
    for shell in ((), ("powershell",)):
        said = ncfix("completion", *shell).err
        assert "bash" in said
        assert "\\n" not in said
