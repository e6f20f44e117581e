"""`ncfix verify`: does the corrected program make this machine cut what the original means?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import click

from ncfix.cli import console
from ncfix.cli.comparing import Compared, compared
from ncfix.cli.completion import PATH
from ncfix.cli.following import Following
from ncfix.cli.options import dialect_option, json_option, machine_option, tolerance_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import shown
from ncfix.diagnostics import ExitCode

FEW = 5
"""Lines that are named by their numbers."""


@click.command()
@click.argument("original", type=PATH)
@click.argument("fixed", type=PATH)
@machine_option
@tolerance_option
@dialect_option
@setup_options
@json_option
def verify(
    original: str,
    fixed: str,
    machine_path: str,
    tolerance_um: float,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> int:
    """Compare what this machine cuts with FIXED with what ORIGINAL means, along the whole path.

    Exit code 1 if the tool tip leaves the intended path by more than the tolerance and what the control's digits
    add, or may, where nobody can look.
    """
    following = Following.of(machine_path, dialect, given)
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
        console.put("".join(f"{line}\n" for line in said(found, tolerance_um)))
    return ExitCode.DONE if found.within else ExitCode.FINDINGS


def said(found: Compared, tolerance_um: float) -> Iterator[str]:
    """What was found, for people."""
    yield f"tip error before: {console.error_figures(found.before)}"
    yield f"tip error after:  {console.error_figures(found.after)}"
    if (found.left_out["max"] or 0.0) > max(tolerance_um + found.rounding_um, found.after["max"] or 0.0):
        yield f"intended path not reached: {console.error_figures(found.left_out)} of the original"
    if found.no_figure:
        yield console.no_figure(found.no_figure)
    if found.unseen:
        yield f"not looked at: {lines_said(found.unseen)} of the original; where they cut is not known"
    limits = f"{tolerance_um:g} um and {found.rounding_um:.2f} um of the control's digits"
    if found.within and found.after["max"] is None:
        yield "nothing cuts: there is nothing to compare"
        return
    if not found.beyond_somewhere:
        yield f"within {limits}" if found.within else unsure(limits)
        return
    of = "" if found.beyond else " of the original"
    yield f"NOT within {limits}: {lines_said(found.beyond or found.not_reached)}{of}"
    for axis, lines in found.left.items():
        where = f"{lines_said(lines)} of the original"
        yield f"along {axis} nothing can be corrected in {where}: the program has not said where {axis} stands there"


def unsure(limits: str) -> str:
    """The verdict where all that was looked at is right, and not all could be."""
    return f"NOT known to be within {limits}: what was looked at is, and the rest may not be"


def lines_said(lines: Sequence[int]) -> str:
    """Lines, the first few by number: `lines 4 5 6 and 12 more`."""
    few = " ".join(map(str, lines[:FEW]))
    more = f" and {len(lines) - FEW} more" if len(lines) > FEW else ""
    return f"line{'s' if len(lines) > 1 else ''} {few}{more}"
