"""The contract that any plugin with compensation tables must pass: `check_control(control)` in its tests.

It makes tables for small machines with single known errors, and judges them by what the plugin reads back.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from ncfix.diagnostics import RefusedError, UsageError
from ncfix.machine import Effect, Machine, loads
from ncfix.machine.basis import Polynomial
from ncfix.tables.control import Control, Request
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export

AXES = """
ncfix = 1
name = "{name}"
topology = "{topology}"
axis.X = {{ type = "linear", direction = [{sense}, 0, 0], range = [-200, 300] }}
axis.Y = {{ type = "linear", direction = [0, 1, 0], range = [-150, 250] }}
axis.Z = {{ type = "linear", direction = [0, 0, 1], range = [-300, 0] }}

[[effect]]
name = "{effect}"
basis = "polynomial"
degree = [1, 2]
scale = 200
coefficients = [{size}, {half}]
"""

CHAINS = {"w F X Y Z t": 1, "w X F Y Z t": -1, "w Y X F Z t": -1}
"""Three-axis chains, with the direction in which the body of X moves: on the tool side and on the workpiece side."""
POSES = 400
"""Random poses at which is looked what the tables of the contract leave."""


def single_error(effect: str, size: float = 0.01, topology: str = "w F X Y Z t") -> Machine:
    """A three-axis machine with one error: `size` (mm or rad) at 200 mm from zero."""
    text = AXES.format(
        name=f"only {effect}", topology=topology, sense=CHAINS[topology], effect=effect, size=size, half=size / 2
    )
    return loads(text)


def check_control(control: Control, settings: Mapping[str, str] | None = None, tool_length: float = 100.0) -> None:
    """Raise AssertionError where a control breaks the contract.

    What is written can be read; the same request gives the same bytes; the linter has nothing to say of fresh files;
    the positioning error of each linear axis, on either side of the chain, goes down to a fifth at least, where a wrong
    sign would double it; no other single error of any axis is made worse; an option that is not there is refused.
    """
    chosen = control.settings(settings or {})
    for topology in CHAINS:
        for axis in "XYZ":
            left = _residual(control, single_error(f"E{axis}{axis}", topology=topology), chosen, tool_length)
            assert left < 0.2, f"{control.name}: E{axis}{axis} on {topology} leaves {left:.2f} of the error"
    with suppress(UsageError):
        control.settings({"no such option": "1"})
        raise AssertionError(f"{control.name}: takes an option that is not there")
    _check_straight(control, chosen, tool_length)
    _check_refusal(control, chosen, tool_length)
    for effect in _others():
        size = 20e-6 if effect[1] in "ABC" else 0.01
        left = _residual(control, single_error(effect, size), chosen, tool_length)
        assert left < 1 + 1e-6, f"{control.name}: {effect} is made worse, {left:.3f} of the error is left"


def _check_straight(control: Control, settings: Mapping[str, str], tool_length: float) -> None:
    straight = (Effect("EXX", (0.01,), Polynomial((1,)), scale=200.0),)
    machine = single_error("EXX").replace(effects=straight)
    request = Request(machine, ranges_of(machine), tool_length, 0.001, settings)
    left = float(export(control, request, POSES).left.after.max())
    allowed = 10 * control.properties.quantum[0]
    assert left <= allowed, f"{control.name}: a straight error leaves {left:.6f} mm, more than {allowed:.6f}"


def _check_refusal(control: Control, settings: Mapping[str, str], tool_length: float) -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (100.0,), Polynomial((1,)), scale=200.0),))
    with suppress(RefusedError):
        export(control, Request(machine, ranges_of(machine), tool_length, 0.001, settings), POSES)
        raise AssertionError(f"{control.name}: takes an error of 100 mm")


def _others() -> list[str]:
    return [f"E{component}{axis}" for axis in "XYZ" for component in "XYZABC" if component != axis]


def _residual(control: Control, machine: Machine, settings: Mapping[str, str], tool_length: float) -> float:
    """The rms error with the tables, as a share of that without."""
    request = Request(machine, ranges_of(machine), tool_length, 0.001, settings)
    made = export(control, request, POSES)
    if machine.name == "only EXX":
        again = control.write(request)
        assert made.native == again.files, f"{control.name}: the same request does not give the same bytes"
    assert made.native, f"{control.name}: no files are written"
    assert all(name == name.split("/")[-1] for name in made.native), f"{control.name}: file names with folders"
    assert not control.lint(made.native), f"{control.name}: its linter objects: {control.lint(made.native)[0]}"
    before, after = (float(np.sqrt(np.mean(values**2))) for values in (made.left.before, made.left.after))
    return after / before if before > 1e-9 else 1.0
