"""`ncfix verify`: does the corrected program make this machine cut what the original means?

Long programs are compared while they are read, if they can be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from ncfix.batch.programs import subprograms
from ncfix.cli import console
from ncfix.cli.following import FollowingSetup, dialect_in, task_of, tell_of_stamp, through
from ncfix.cli.options import PATH, dialect_option, json_option, machine_option, read_program, tolerance_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.projects import ProjectCommand, project_options
from ncfix.cli.streams import Source, source_of
from ncfix.cli.targets import STREAM, shown
from ncfix.diagnostics import ExitCode, Message, lines_named
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.compensate.figures.comparison import RunningComparison
    from ncfix.compensate.figures.verification import Compared
    from ncfix.text.dialect import Dialect
    from ncfix.text.tree import Program

Said = tuple[Sequence[Message], ...]
"""Messages from following the original and the corrected program."""


@frozen
class ProgramPair:
    """The two programs, and what is needed to follow them."""

    following: FollowingSetup
    original: Source
    fixed: Source
    tolerance_um: float

    def compared(self) -> tuple[Sequence[RunningComparison], Said]:
        """The comparison of both paths on this machine with the path intended by the original, for each position of
        block delete; and the messages from following them.
        """
        return through((self.original, self.fixed), self._in_parts, self._as_wholes)

    def _in_parts(self) -> tuple[Sequence[RunningComparison], Said]:
        """Compare while reading; raises errors of reading, `NotInPartsError` and `NearestNotHereError`."""
        from ncfix.compensate.figures.comparison import CutPaths

        dialect = dialect_in(self.following, self.original)
        found = self._side_by_side(dialect)
        cuts = []
        for source, beside in ((self.original, ()), (self.fixed, (self.original.path,))):
            task = task_of(self.following, source, dialect, *beside)
            cuts.append(CutPaths(task, source.read, meant=source is self.original))
        found.run(*map(iter, cuts))
        return [found], tuple(each.said for each in cuts)

    def _as_wholes(self) -> tuple[Sequence[RunningComparison], Said]:
        from ncfix.compensate.figures.verification import side_by_side

        machine, setup = self.following.machine, self.following.setup
        assert machine is not None
        first, second = self.original.path, self.fixed.path
        meant = self._read(self.original)
        resolves = subprograms(setup, first), subprograms(setup, second, first)
        return side_by_side(meant, self._read(self.fixed, meant), machine, setup, self.tolerance_um, resolves)

    def _side_by_side(self, dialect: Dialect) -> RunningComparison:
        from ncfix.compensate.figures.comparison import RunningComparison
        from ncfix.compensate.following import resolving
        from ncfix.compensate.plan.written import rounding

        assert self.following.machine is not None
        there = resolving(self.following.machine, dialect, self.original.head)
        return RunningComparison(self.tolerance_um / 1e3, rounding(there))

    def _read(self, source: Source, like: Program | None = None) -> Program:
        """A program; one from a file is read in the dialect of `like`, if possible."""
        text, following = source.everything(), self.following
        like = None if source.path == STREAM else like
        return read_program(source.path, following.dialect, following.machine, text, like)


def compared(following: FollowingSetup, original: str, fixed: str, tolerance_um: float) -> Compared:
    """Compare both programs on this machine with the path intended by the original; prints the messages."""
    with source_of(original) as first, source_of(fixed) as second:
        beside, messages = ProgramPair(following, first, second, tolerance_um).compared()
        tell_of_stamp(first)
    from ncfix.compensate.figures.verification import Compared

    found = Compared.of_all(beside, messages)
    console.tell_some(found.messages)
    return found


@click.command(cls=ProjectCommand)
@click.argument("original", type=PATH)
@click.argument("fixed", type=PATH)
@machine_option
@tolerance_option
@dialect_option
@setup_options
@click.option(
    "--certificate",
    type=PATH,
    metavar="FILE",
    help="Prove FIXED with an independent reader instead; write its certificate (JSON).",
)
@click.option(
    "--against",
    type=PATH,
    metavar="FILE",
    help="Check that this certificate belongs to these files and is still valid.",
)
@project_options
@json_option
def verify(
    original: str,
    fixed: str,
    machine_path: str,
    tolerance_um: float,
    dialect: str | None,
    given: SetupOptions,
    certificate: str | None,
    against: str | None,
    as_json: bool,
) -> int:
    """Compare the path of the tool tip under FIXED on this machine with the intended path of ORIGINAL.

    Exit code 1: the tool tip leaves the intended path by more than the tolerance plus the rounding to the control's
    digits, or a part of the path that may cut could not be examined.
    """
    following = FollowingSetup.of(machine_path, dialect, given)
    if certificate is not None or against is not None:
        from ncfix.cli.shop.certificates import Proving, verify_certificate

        assert following.machine is not None
        proving = Proving(following.machine, machine_path, following.setup, dialect, tolerance_um)
        return verify_certificate(proving, original, fixed, certificate, against, as_json)
    with console.busy(f"comparing {shown(fixed)} with {shown(original)}"):
        found = compared(following, original, fixed, tolerance_um)
    if as_json:
        console.put_json(
            original=shown(original),
            fixed=shown(fixed),
            error_before_um=found.before,
            error_after_um=found.after,
            left_out_um=found.left_out,
            rounding_um=round(found.rounding_um, 4),
            within=found.within,
            lines_beyond=found.beyond,
            lines_not_reached=found.not_reached,
            lines_not_looked_at=found.unseen,
            no_figure=found.no_figure,
            left_where_it_stands=[{"axis": axis, "lines": lines} for axis, lines in found.left.items()],
        )
    else:
        console.put("".join(f"{line}\n" for line in verdict(found, tolerance_um)))
    return ExitCode.DONE if found.within else ExitCode.FINDINGS


def verdict(found: Compared, tolerance_um: float) -> Iterator[str]:
    """The result in words."""
    at = " of the original" if found.before.get("where") else ""
    yield f"tip error before: {console.error_figures(found.before)}{at}"
    yield f"tip error after:  {console.error_figures(found.after)}"
    if (found.left_out["max"] or 0.0) > max(tolerance_um + found.rounding_um, found.after["max"] or 0.0):
        yield f"intended path not reached: {console.error_figures(found.left_out)} of the original"
    if found.no_figure:
        yield console.no_figure(found.no_figure)
    if found.unseen:
        yield f"not examined: {_named(found.unseen)} of the original; their position is not known"
    limits = f"{tolerance_um:g} um, plus {found.rounding_um:.2f} um for the control's digits"
    if found.within and found.after["max"] is None:
        yield "no motion cuts: there is nothing to compare"
        return
    if not found.beyond_somewhere:
        yield f"within {limits}" if found.within else unsure(limits)
        return
    of = "" if found.beyond else " of the original"
    yield f"NOT within {limits}: {_named(found.beyond or found.not_reached)}{of}"
    for axis, lines in found.left.items():
        where = f"{_named(lines)} of the original"
        yield f"{axis} cannot be corrected in {where}: the program has not given the position of {axis} there"


def unsure(limits: str) -> str:
    """The verdict if all examined motions are right, but not all could be examined."""
    return f"NOT known to be within {limits}: all examined motions are, but some could not be examined"


def _named(lines: Sequence[int]) -> str:
    """Lines in ascending order, in words."""
    import numpy as np

    from ncfix.arrays import in_stretches

    return lines_named(in_stretches(np.array(lines)))
