"""`ncfix verify`: does the corrected program make this machine cut what the original means?"""

from __future__ import annotations

import click

from ncfix.cli import console
from ncfix.cli.following import Following
from ncfix.cli.options import dialect_option, json_option, machine_option, tolerance_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import shown
from ncfix.diagnostics import ExitCode


@click.command()
@click.argument("original")
@click.argument("fixed")
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

    Exit code 1 if the tool tip leaves the intended path by more than the tolerance.
    """
    following = Following.of(machine_path, dialect, given)
    with console.busy(f"comparing {shown(fixed)} with {shown(original)}"):
        before, after, back = following.compared(original, fixed)
    within = max(after["max"], back["max"]) <= tolerance_um
    if as_json:
        console.put_json(
            original=shown(original),
            fixed=shown(fixed),
            error_before_um=before,
            error_after_um=after,
            left_out_um=back,
            within=within,
        )
    else:
        console.put(f"tip error before: {console.error_figures(before)}\n")
        console.put(f"tip error after:  {console.error_figures(after)}\n")
        if back["max"] > max(tolerance_um, after["max"]):
            console.put(f"intended path not reached: {console.error_figures(back)} of the original\n")
        console.put(f"{'within' if within else 'NOT within'} {tolerance_um:g} um\n")
    return ExitCode.DONE if within else ExitCode.FINDINGS
