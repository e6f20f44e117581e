"""The command `ncfix`: finds the verb, runs it, and turns whatever happens into messages and an exit code."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module

import click

from ncfix import __version__
from ncfix.cli import console
from ncfix.cli.faults import fault
from ncfix.diagnostics import ExitCode, Message, NcfixError
from ncfix.plugins import PluginWarning, registry

VERBS = (
    "fix",
    "check",
    "trace",
    "verify",
    "simulate",
    "plan",
    "calibrate",
    "diagnose",
    "export",
    "emulate",
    "report",
    "derive",
    "machine",
    "effects",
    "dialects",
    "plugins",
    "explain",
    "completion",
)
"""The built-in verbs in the order of `--help`; verb `x` is the command `x` in the module `ncfix.cli.x`."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 + SIGINT."""

BROKEN_PIPE = 141
"""Exit code when the reader of standard output has gone: 128 + SIGPIPE."""


class Verbs(click.Group):
    """The verbs, each imported when it is asked for; those of plugins come after the built-in ones."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All verbs."""
        return [*VERBS, *sorted(name for name in registry("commands", dict.fromkeys(VERBS)) if name not in VERBS)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """One verb; plugins are only loaded if it is not a built-in one."""
        if cmd_name in VERBS:
            command: click.Command = getattr(import_module(f"ncfix.cli.{cmd_name}"), cmd_name)
            return command
        return registry("commands").get(cmd_name)


@click.command(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="ncfix", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of a fault of ncfix (also NCFIX_DEBUG=1).")
def cli(debug: bool) -> None:
    """Make a machine tool cut right: know its errors, rewrite its programs."""


def main() -> None:
    """The console script."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Run one command line; the exit code. Nothing is raised."""
    as_json = "--json" in arguments
    try:
        with plugin_warnings_as_messages():
            return int(cli.main(list(arguments), prog_name="ncfix", standalone_mode=False) or 0)
    except click.ClickException as error:
        return wrong_use(error)
    except NcfixError as error:
        return failed(error, as_json)
    except click.Abort:
        console.tell(Message("NCF012", "interrupted"))
        return INTERRUPTED
    except console.ReaderGoneError:
        return BROKEN_PIPE
    except Exception as error:
        if "--debug" in arguments or os.environ.get("NCFIX_DEBUG", "") not in ("", "0"):
            import traceback

            console.say("".join(traceback.format_exception(error)))
        return failed(fault(error), as_json)


def wrong_use(error: click.ClickException) -> int:
    """Say what is wrong with the command line."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        console.say(error.format_message())
    else:
        context = getattr(error, "ctx", None)
        command = context.command_path if context else "ncfix"
        console.tell(Message("NCF001", error.format_message(), hint=f"{command} --help"))
    return ExitCode.USAGE


def failed(error: NcfixError, as_json: bool) -> int:
    """Say what failed, also on standard output where that was asked to be JSON."""
    console.tell(*error.messages)
    if as_json:
        with suppress(NcfixError, console.ReaderGoneError):
            console.put_json(errors=[message.as_dict() for message in error.messages])
    return error.exit_code


@contextmanager
def plugin_warnings_as_messages() -> Iterator[None]:
    """Show that a plugin was left out as a coded message instead of a Python warning."""
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
