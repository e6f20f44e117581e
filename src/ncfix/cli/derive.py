"""`ncfix derive`: the error equations of a machine, symbolically."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import force_option, json_option, load_machine
from ncfix.cli.targets import STREAM, Outputs, targets

if TYPE_CHECKING:
    from ncfix.machine.symbolic import Derivation

CONSTANT = ("locations", "spindle")
"""The errors of a machine that a protocol is made for, unless it is said otherwise: those that are constants."""


@click.command()
@click.option("-m", "--machine", "machine_path", type=PATH, metavar="FILE", help="The machine file (TOML).")
@click.option(
    "--chain", "chain_path", type=PATH, metavar="FILE", help="A chain file (docs/derive.md) instead of a machine."
)
@click.option("--order", type=click.IntRange(1, 4), default=1, show_default=True, help="Order of the errors.")
@click.option("--effects", metavar="LIST", help="Groups motions, locations, spindle, machine; names or patterns: E?C.")
@click.option("--letters", is_flag=True, help="Fixed angles between axes as letters instead of their values.")
@click.option("--latex", "form", flag_value="latex", help="Print LaTeX.")
@click.option("--python", "form", flag_value="python", help="Print a Python module of numpy functions.")
@click.option("--protocol", "form", flag_value="protocol", help="Print what can be identified, and a protocol.")
@click.option("--vary", metavar="LIST", default="tool_length", help="Lengths to vary as well, for --protocol.")
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", default=STREAM, help="Where to write instead of standard output."
)
@force_option
@json_option
def derive(
    machine_path: str | None,
    chain_path: str | None,
    order: int,
    effects: str | None,
    letters: bool,
    form: str | None,
    vary: str,
    output: str,
    force: bool,
    as_json: bool,
) -> None:
    """Derive the nominal formulas and the error formulas of a machine, simplified.

    Needs the extra `symbolic`: pip install "ncfix[symbolic]".
    """
    if (machine_path is None) == (chain_path is None):
        raise click.UsageError("give one of --machine and --chain")
    if as_json and form and output == STREAM:
        raise click.UsageError(f"--json prints the formulas in a form of its own; --{form} beside it needs -o FILE")
    source = machine_path or chain_path or ""
    target = targets([source], Outputs(output, force=force))[0]
    from ncfix.machine import symbolic

    include = effects.split(",") if effects else None
    if chain_path is not None:
        derivation = symbolic.derive(symbolic.load_chain(chain_path), order, include)
    else:
        include = list(CONSTANT) if include is None and form == "protocol" else include
        with console.busy("deriving"):
            derivation = symbolic.derive(load_machine(source), order, include, letters)
    if not as_json or target.file:
        with console.busy("writing the formulas"):
            text = _written(derivation, form, vary.split(","))
        target.write(text.encode())
    if as_json:
        console.put_json(**_as_dict(derivation))


def _written(derivation: Derivation, form: str | None, vary: list[str]) -> str:

    from ncfix.machine.symbolic import measuring, to_latex, to_python, to_text

    if form == "protocol":
        return measuring(derivation, vary)
    return {"latex": to_latex, "python": to_python}.get(form or "", to_text)(derivation)


def _as_dict(derivation: Derivation) -> dict[str, Any]:
    from ncfix.machine.symbolic import inverse_nominal

    inverse = inverse_nominal(derivation)
    return {
        "name": derivation.chain.name,
        "order": derivation.order,
        "variables": [
            {"name": v.name, "size": v.size.value, "axis": v.axis, "value": v.value, "definition": v.definition}
            for v in derivation.chain.variables
        ],
        "nominal": {name: str(formula) for name, formula in derivation.nominal.items()},
        "inverse": {name: str(formula) for name, formula in inverse.formulas.items()},
        "inverse_notes": inverse.notes,
        "error": {name: str(formula) for name, formula in derivation.error.items()},
        "without_effect": derivation.without_effect,
    }
