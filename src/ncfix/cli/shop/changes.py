"""`ncfix fix --diff`: shows what a correction would change, as text or as motions; writes nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ncfix.batch.programs import ProgramFile, subprograms
from ncfix.cli import console
from ncfix.cli.console import owned
from ncfix.cli.options import dialect_of
from ncfix.cli.targets import read, shown
from ncfix.diagnostics import ExitCode, visible

if TYPE_CHECKING:
    from ncfix.cli.shop.batch import FixJob
    from ncfix.compensate.changes import Changes, MotionChange

COLUMNS = ("line", "axis", "from", "to", "change", "why")


def show_changes(job: FixJob, program: ProgramFile, motions: bool, as_json: bool) -> tuple[int, dict[str, Any]]:
    """Print what would change in a program; returns the exit code and the entry in the JSON object."""
    from ncfix.compensate.changes import Changes, as_plain
    from ncfix.text.reader import read as read_source

    path = program.path
    name = shown(path)
    entry: dict[str, Any] = {"path": name}
    if why := program.left_out:
        console.tell(why)
        return ExitCode.DONE, {**entry, "left_out": True, "changed": False, "motions": [], "refused": []}
    try:
        with console.busy(f"fixing {name}"):
            text = read(path)
            source = read_source(text, name, dialect_of(text, name, job.dialect, job.machine))
            find = subprograms(job.setup, path)
            changes = Changes.of(source, job.machine, job.setup, job.options, find)
            found = list(changes.motions())
    except Exception as error:
        own = owned(error)
        console.tell(*own.messages)
        return own.exit_code, {**entry, "errors": own.messages}
    report = changes.fixed.report
    refused = report.refusals
    console.tell_some([*report.warnings, *refused])
    if refused and not job.options.allow_refused:
        console.say(
            f"{visible(name)}: {console.counted(len(refused), 'motion')} refused, so `ncfix fix` would write nothing"
        )
        return ExitCode.REFUSED, {**entry, "changed": False, "motions": [], "refused": refused}
    if not as_json:
        _put(changes, found, motions, text, name)
    entry |= {"changed": changes.fixed.changed, "motions": as_plain(found), "refused": []}
    return ExitCode.FINDINGS if changes.fixed.changed else ExitCode.DONE, entry


def _put(changes: Changes, found: list[MotionChange], motions: bool, text: bytes, name: str) -> None:
    if not motions:
        console.put(b"".join(changes.unified(text, name, f"{name} (corrected)")))
        return
    if found:
        console.put(f"{visible(name)}\n")
        console.table(COLUMNS, [_row(each) for each in found])


def _row(each: MotionChange) -> tuple[str, ...]:
    digits, unit = (5, "mdeg") if each.rotary else (4, "um")
    places = (f"{value:.{digits}f}" for value in (each.before, each.after))
    return (str(each.line), each.axis, *places, f"{each.change:+.1f} {unit}", each.reason)
