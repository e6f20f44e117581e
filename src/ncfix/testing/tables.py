"""The contract for controls with compensation tables: `check_control(control)` in the tests of a plugin.

It makes tables for small machines with single known errors, and evaluates them as the plugin reads them back.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import NcfixError, RefusedError, UsageError
from ncfix.machine import Effect, Machine, loads
from ncfix.machine.basis import Polynomial
from ncfix.tables.control import Control, Request
from ncfix.tables.correction import random_poses, random_ways, ranges_of, residual
from ncfix.tables.export import Exported, export

AXES = """
ncfix = 1
name = "{name}"
topology = "{topology}"
axis.X = {{ type = "linear", direction = [{sense}, 0, 0], range = [-200, 300] }}
axis.Y = {{ type = "linear", direction = [0, 1, 0], range = [-150, 250] }}
axis.Z = {{ type = "linear", direction = [0, 0, 1], range = [-300, 0] }}
"""
EFFECT = """
[[effect]]
name = "{effect}"
basis = "polynomial"
degree = [1, 2]
scale = 200
coefficients = [{size}, {half}]
"""
PLAY = """
[[effect]]
name = "EXX"
basis = "backlash"
coefficients = [0.01]
"""
TABLES = """
axis.B = { type = "rotary", direction = [0, 1, 0], point = [0, 0, -200], range = [-90, 90] }
axis.C = { type = "rotary", direction = [0, 0, 1], point = [0, 0, 0], range = [-180, 180] }
"""
"""Two rotary axes that carry the workpiece."""

CHAINS = {"w F X Y Z t": 1, "w X F Y Z t": -1, "w Y X F Z t": -1}
"""Three-axis chains, and the direction of X's body: X on the tool side and on the workpiece side."""
POSES = 400
"""Number of random poses at which the remaining errors are computed."""
QUANTA = 1.5
"""Largest rest of a straight error, in steps of the file's values: half a step at two nodes, and their positions."""
MAX_RELATIVE_REST = 1.01
"""Largest rest of an error that the tables cannot correct, relative to it; rounding of other entries adds to it."""
DAMAGED = 12
"""Number of lines of each file that are made unreadable, one at a time."""
UNREADABLE = b"1.0 ?? unreadable"


def single_error(effect: str, size: float = 0.01, topology: str = "w F X Y Z t") -> Machine:
    """A three-axis machine with one error: `size` (mm or rad) at 200 mm from zero."""
    axes = AXES.format(name=f"only {effect}", topology=topology, sense=CHAINS[topology])
    return loads(axes + EFFECT.format(effect=effect, size=size, half=size / 2))


def _rotary_error(effect: str) -> Machine:
    """A machine with rotary tables B and C, and an angular error of one of them, 1e-4 rad at 200 degrees."""
    axes = AXES.format(name=f"only {effect}", topology="w C B F X Y Z t", sense=1)
    return loads(axes + TABLES + EFFECT.format(effect=effect, size=1e-4, half=0.5e-4))


def _play() -> Machine:
    """A three-axis machine with 10 um play of X."""
    return loads(AXES.format(name="play", topology="w F X Y Z t", sense=1) + PLAY)


def check_control(control: Control, settings: Mapping[str, str] | None = None, tool_length: float = 100.0) -> None:
    """Raise AssertionError if a control violates the contract.

    Checks: Written files can be read. The same request gives the same bytes. The linter has no objection to fresh
    files. The positioning error of each linear axis, on either side of the chain, is reduced to a fifth or less (a
    wrong sign would double it). A straight error is removed except for the steps of the file's values
    (`Properties.quantum`). No other single error of an axis, rotary axes included, is made worse, nor is play. An
    unreadable line is rejected by `lint` or `read`, unless it makes no difference. An unknown option is refused.
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
    _check_damage(control, _request(single_error("EXX"), chosen, tool_length))
    _check_refusal(control, chosen, tool_length)
    sizes = {effect: 20e-6 if effect[1] in "ABC" else 0.01 for effect in _others()}
    machines = [single_error(effect, size) for effect, size in sizes.items()]
    for machine in (_play(), _rotary_error("EBB"), _rotary_error("ECC"), *machines):
        request = _request(machine, chosen, tool_length)
        made = residual(machine, control.read(control.write(request).files), request.space, tool_length, POSES)
        left = _rms(made.after) / _rms(made.before) if made.before.any() else 1.0
        assert left < MAX_RELATIVE_REST, (
            f"{control.name}: {machine.name} is made worse, {left:.3f} of the error is left"
        )


def _check_straight(control: Control, settings: Mapping[str, str], tool_length: float) -> None:
    straight = (Effect("EXX", (0.00987,), Polynomial((1,)), scale=200.0),)
    machine = single_error("EXX").replace(effects=straight)
    left = float(_export(control, _request(machine, settings, tool_length)).left.after.max())
    allowed = QUANTA * control.properties.quantum[0]
    assert left <= allowed, f"{control.name}: a straight error leaves {left:.6f} mm, more than {allowed:.6f}"


def _check_damage(control: Control, request: Request) -> None:
    """Check that an unreadable line is not ignored."""
    made = _export(control, request)
    names, q, ways = request.machine.axis_names, random_poses(request.space, POSES), random_ways(3, POSES)
    meant = control.read(made.native).at(names, q, ways)
    for name, content in made.native.items():
        lines = content.splitlines(keepends=True)
        for row in sorted({*np.linspace(0, len(lines) - 1, DAMAGED).astype(int).tolist()}):
            kept = lines[row].rstrip(b"\r\n")
            damaged = b"".join((*lines[:row], UNREADABLE + lines[row][len(kept) :], *lines[row + 1 :]))
            told = f"{control.name}: {name}, line {row + 1}: {kept[:40].decode('latin-1')!r} made unreadable"
            try:
                if control.lint({**made.native, name: damaged}):
                    continue
                found = control.read({**made.native, name: damaged}).at(names, q, ways)
            except NcfixError:
                continue
            except Exception as error:
                raise AssertionError(f"{told} raises {type(error).__name__}: {error}") from error
            assert np.array_equal(found, meant), f"{told} changes what is read, and nobody objects"


def _check_refusal(control: Control, settings: Mapping[str, str], tool_length: float) -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (100.0,), Polynomial((1,)), scale=200.0),))
    with suppress(RefusedError):
        export(control, _request(machine, settings, tool_length), POSES)
        raise AssertionError(f"{control.name}: takes an error of 100 mm")


def _others() -> list[str]:
    return [f"E{component}{axis}" for axis in "XYZ" for component in "XYZABC" if component != axis]


def _request(machine: Machine, settings: Mapping[str, str], tool_length: float) -> Request:
    return Request(machine, ranges_of(machine), tool_length, 0.001, settings)


def _export(control: Control, request: Request) -> Exported:
    """The files with the errors that they leave; a refusal violates the contract."""
    try:
        return export(control, request, POSES)
    except RefusedError as error:
        raise AssertionError(f"{control.name}: {request.machine.name}: {error}") from error


def _residual(control: Control, machine: Machine, settings: Mapping[str, str], tool_length: float) -> float:
    """The rms error with the tables, relative to that without."""
    request = _request(machine, settings, tool_length)
    made = _export(control, request)
    if machine.name == "only EXX":
        again = control.write(request)
        assert made.native == again.files, f"{control.name}: the same request does not give the same bytes"
    assert made.native, f"{control.name}: no files are written"
    assert all(name == name.split("/")[-1] for name in made.native), f"{control.name}: file names with folders"
    assert not control.lint(made.native), f"{control.name}: its linter objects: {control.lint(made.native)[0]}"
    return _rms(made.left.after) / _rms(made.left.before)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
