"""The command `ncfix`: finds the verb, runs it, and turns every result or exception into messages and an exit code."""

from __future__ import annotations

import gc
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from io import TextIOWrapper

import click

from ncfix.cli import console
from ncfix.cli.console import debugging, owned
from ncfix.diagnostics import ExitCode, Message, NcfixError, UsageError
from ncfix.plugins import PluginWarning, registry
from ncfix.version import __version__

VERBS = {
    "fix": "Correct programs for the errors of this machine.",
    "watch": "Correct the programs that arrive in a folder, each when it is complete.",
    "check": "Find faults in programs and what cannot be corrected; write nothing.",
    "trace": "Print the motions of a program as a table.",
    "verify": "Compare a corrected program with its original by simulation.",
    "simulate": "Compute the tip error of an uncorrected program, or simulate a measurement.",
    "plan": "Choose the poses of a measurement.",
    "calibrate": "Estimate the errors of a machine from measurements.",
    "diagnose": "Find and name the effects that the model of a machine lacks.",
    "export": "Write compensation tables for a control.",
    "emulate": "Run the tables of a folder and compute the remaining error.",
    "lint": "Find faults in compensation table files.",
    "report": "Write a page about a program, machines or results.",
    "derive": "Derive the kinematic formulas of a machine and of its errors.",
    "machine": "Check or show a machine file.",
    "effects": "List the errors that a machine file may have.",
    "dialects": "List the control languages that can be read.",
    "plugins": "List the plugins and what each adds.",
    "init": "Write a project file, so that programs need no options.",
    "explain": "Explain a message code.",
    "doctor": "Check the installation.",
    "manual": "Print the manual page.",
    "completion": "Print the completion script of a shell.",
}
"""The built-in verbs in the order of `--help`."""

MODULES = {
    **dict.fromkeys(("check", "trace"), "programs"),
    **dict.fromkeys(("plan", "calibrate", "diagnose"), "measurements"),
    **dict.fromkeys(("export", "emulate", "lint"), "tables"),
    **dict.fromkeys(("derive", "effects"), "machine"),
    "init": "shop.projects",
    "watch": "shop.watch",
    **dict.fromkeys(("dialects", "plugins", "explain", "completion"), "listings"),
}
"""Verb -> module of `ncfix.cli` with its command, if the module has another name."""

PROJECT_VERBS = ("fix", "verify", "simulate")
"""Verbs that need a machine, which a project file can give."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 + SIGINT."""

MOST_DIGITS = 1 << 17
"""Largest number of digits of an integer; not less than the characters of the longest line that a control reads."""

BROKEN_PIPE = 141
"""Exit code if the reader of standard output closed it: 128 + SIGPIPE."""


class Verbs(click.Group):
    """The group of verbs, each imported on use; those of plugins follow the built-in ones."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All verbs."""
        return [*VERBS, *sorted(name for name in registry("commands", dict.fromkeys(VERBS)) if name not in VERBS)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """One verb; plugins are loaded only if it is not built in."""
        if cmd_name in VERBS:
            return getattr(import_module(f"ncfix.cli.{MODULES.get(cmd_name, cmd_name)}"), cmd_name)
        return registry("commands").get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The verb at the beginning of the arguments; for an unknown one, the error suggests a similar one."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            from difflib import get_close_matches

            close = get_close_matches(args[0], self.list_commands(ctx), 1)
            text = f"there is no verb {args[0]!r}" + (f"; did you mean {close[0]!r}?" if close else "")
            raise click.UsageError(text, error.ctx) from error

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the verbs with their summaries; built-in ones are not imported for that."""
        others = {name: self.get_command(ctx, name) for name in self.list_commands(ctx) if name not in VERBS}
        summaries = VERBS | {name: command.get_short_help_str(60) for name, command in others.items() if command}
        with formatter.section("Commands"):
            formatter.write_dl(list(summaries.items()))


@click.command(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="ncfix", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of an internal fault (also NCFIX_DEBUG=1).")
def cli(debug: bool) -> None:
    """Correct the geometric errors of a machine tool: in its NC programs, or by tables of its control."""


def main() -> None:
    """Entry point of the console script.

    Warnings of numpy on unusual input are shown only when debugging. Python's limit on the digits of integers is
    raised, because a line of a program may have more.
    """
    sys.set_int_max_str_digits(MOST_DIGITS)
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name may have bytes that are no characters
    if not sys.warnoptions and "--debug" not in sys.argv:
        warnings.simplefilter("ignore", RuntimeWarning)
    code = run(sys.argv[1:])
    console.abandon_unwritable()
    gc.freeze()  # what is left ends with the process, and need not be gone through for cycles
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command line; returns the exit code and raises nothing."""
    with debugging("--debug" in arguments):
        return _run(arguments)


def _run(arguments: Sequence[str]) -> int:
    as_json = next((option for option in ("--json", "--json-lines") if option in arguments), None)
    try:
        if any("\0" in argument for argument in arguments):
            raise UsageError.of("NCF001", "an argument contains a NUL character", hint="a file name cannot contain one")
        with plugin_warnings_as_messages():
            return int(cli.main(list(arguments), prog_name="ncfix", standalone_mode=False) or 0)
    except click.ClickException as error:
        return wrong_use(error, arguments, as_json)
    except click.Abort:
        console.tell(Message("NCF012", "interrupted"))
        return INTERRUPTED
    except console.ReaderGoneError:
        return BROKEN_PIPE
    except Exception as error:
        return failed(owned(error), as_json)


def wrong_use(error: click.ClickException, arguments: Sequence[str], as_json: str | None) -> int:
    """Report a wrong command line; returns the exit code."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        console.say(error.format_message())
        return ExitCode.USAGE
    context = getattr(error, "ctx", None)
    verb = next((argument for argument in arguments if argument in VERBS), "")
    command = context.command_path if context else f"ncfix {verb}".strip()
    text = error.format_message().replace("\n\t", " ")  # names of choices, each on a line
    lacks = isinstance(error, click.MissingParameter) and error.param is not None and error.param.name
    hint = (
        "-m FILE, or name it once for a folder with `ncfix init`"
        if lacks == "machine_path" and verb in PROJECT_VERBS
        else ""
    )
    return failed(UsageError.of("NCF001", text, hint=hint or f"{command} --help"), as_json)


def failed(error: NcfixError, as_json: str | None) -> int:
    """Report a failure, with --json or --json-lines (`as_json`) also on standard output; returns the exit code."""
    console.tell(*error.messages)
    if as_json:
        with suppress(NcfixError, console.ReaderGoneError):
            indent = 1 if as_json == "--json" else None
            console.put(console.json_text(indent, errors=error.messages))
    return error.exit_code


@contextmanager
def plugin_warnings_as_messages() -> Iterator[None]:
    """Context in which a warning about a plugin is shown as a coded message."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", PluginWarning)
        show = warnings.showwarning

        def show_message(message: Warning | str, *rest: object, **more: object) -> None:
            if isinstance(message, PluginWarning):
                console.tell(message.message)
            else:
                show(message, *rest, **more)  # type: ignore[arg-type]

        warnings.showwarning = show_message
        yield
