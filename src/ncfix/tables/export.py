"""Export and emulation of tables: made, written, read back from the files, and run; the residual is that of the files.

A side file states the machine, the files and the settings.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import ConfigError, Message, Place, RefusedError
from ncfix.machine import Machine
from ncfix.plugins import called, handed, useless
from ncfix.tables.compensation import Tables
from ncfix.tables.control import Control, Files, Least, Request, Written
from ncfix.tables.correction import POSES, Residual, random_poses, ranges_of, residual
from ncfix.tables.sheet import as_html, as_markdown
from ncfix.values import frozen
from ncfix.version import __version__

SIDE_FILE = "ncfix-tables.json"
SCHEMA = 1
SHEET = "hand-over"
CLOSE = 1e-9
"""Largest difference of equal range limits, mm or rad."""
WORTH = 0.95
"""Ratio of the rms errors after and before above which tables have next to no effect."""
TURN = 2 * np.pi
TURNED = 64
"""Number of poses at which an endless axis is checked one turn further."""
LEVER = 100.0
"""Distance at which an angle is compared with a length, mm."""


@frozen
class Manifest:
    """The content of a side file.

    control      name of the control that wrote the files
    machine      name of the machine; hash: of everything that affects its correction
    ranges       axis -> lowest and highest position covered, mm or degree
    tool_length  tool length for which the tables hold, mm
    settings     options of the control
    files        name -> SHA-256 of the content
    """

    control: str
    machine: str
    hash: str
    ranges: Mapping[str, tuple[float, float]]
    tool_length: float
    settings: Mapping[str, str]
    files: Mapping[str, str]

    def as_bytes(self, **more: Any) -> bytes:
        """The JSON text of the side file, with further fields for people."""
        fields = {name: getattr(self, name) for name in Manifest.__match_args__}
        return (json.dumps({"ncfix-tables": SCHEMA, **fields, **more}, indent=1) + "\n").encode()

    def changed(self, files: Mapping[str, bytes], folder: str) -> tuple[Message, ...]:
        """Remarks NCF488 on files that differ from what was written."""
        return tuple(
            Message("NCF488", "was changed since it was exported", Place(f"{folder}/{name}"), "export again")
            for name, expected in self.files.items()
            if name in files and digest(files[name]) != expected
        )


def digest(content: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def read_manifest(data: bytes, path: str) -> Manifest:
    """Read the side file; raises `ConfigError` NCF486."""

    def texts(record: Mapping[str, Any]) -> dict[str, str]:
        return {str(name): str(value) for name, value in record.items()}

    try:
        found = json.loads(data)
        if found["ncfix-tables"] != SCHEMA:
            raise ValueError(f"schema {found['ncfix-tables']!r}, not {SCHEMA}")
        ranges = {str(axis): (float(low), float(high)) for axis, (low, high) in found["ranges"].items()}
        whose = (str(found["control"]), str(found["machine"]), str(found["hash"]))
        return Manifest(*whose, ranges, float(found["tool_length"]), texts(found["settings"]), texts(found["files"]))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        text = f"is not the side file of exported tables: {error}"
        raise ConfigError.of("NCF486", text, Place(path), "export again") from error


def remarks_of(data: bytes) -> tuple[tuple[str, ...], Least | None]:
    """Notes of the export in a side file, and its lower bound of the error; empty and None if it has none."""
    found = json.loads(data)
    notes, least = found.get("notes"), found.get("least_um")
    texts = tuple(str(note) for note in notes) if isinstance(notes, list) else ()
    try:
        return texts, Least(float(least["max"]) / 1e3, str(least["why"])) if least else None
    except (KeyError, TypeError, ValueError):
        return texts, None


def check_origin(manifest: Manifest, control: str, machine: Machine | None, path: str) -> None:
    """Refuse tables of another control, or of another machine unless that is None: raises `RefusedError` NCF487."""
    place = Place(path)
    if manifest.control != control:
        text, hint = (
            f"these tables are for the control {manifest.control}, not {control}",
            f"ncfix emulate {manifest.control}",
        )
        raise RefusedError.of("NCF487", text, place, hint)
    if machine is not None and manifest.hash != machine.hash:
        text = f"these tables were made for another machine, or for other errors of it: {manifest.machine}"
        hint = "export them again for this machine file, or use --other-machine"
        if machine.inputs:
            hint = f"give {', '.join(sorted(machine.inputs))} with --input as for the export, or {hint}"
        raise RefusedError.of("NCF487", text, place, hint)


@frozen
class ProgramWithTables:
    """Errors of a program with tables active, or, for a control without tables, rewritten.

    before, after  tip errors where it cuts, um: `max`, `rms`, and `where`, the line of the largest
    remarks        reasons why the tables do not fit the program
    """

    path: str
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    remarks: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The object that commands print with --json."""
        figures = {"error_before_um": self.before, "error_after_um": self.after}
        return {"path": self.path, **figures, "remarks": self.remarks}


@frozen(eq=False)
class Exported:
    """Exported or emulated files, with their residual.

    native   the control's own files
    files    all files, including side file and hand-over sheet
    tables   the tables as the control reads them
    left     the residual at random poses
    least    lower bound of the error of any tables of this kind, if known
    reaches  ISO/TR 16907 class of the tables
    program  errors along a program, if one was given
    """

    native: Files
    files: Files
    tables: Tables
    left: Residual
    notes: tuple[str, ...]
    messages: tuple[Message, ...]
    least: Least | None = None
    reaches: str = ""
    program: ProgramWithTables | None = None

    def limits(self) -> dict[str, Any]:
        """How much of what the control can hold is used."""
        sizes = [grid.points for grid in self.tables.grids]
        return {"tables": len(sizes), "points": self.tables.points, "largest": max(sizes, default=0)}


def export(control: Control, request: Request, poses: int = POSES) -> Exported:
    """Write the tables of a machine, read them back, and evaluate them by running them.

    Raises `RefusedError`: NCF484 for what the format cannot hold, NCF489 for corrections beyond what the machine
    allows, NCF490 for tables that leave more than there was before.
    """
    if any(not np.isfinite(effect.coefficients).all() for effect in request.machine.effects):
        raise RefusedError.of("NCF489", "an error of the machine is not a number", hint="calibrate it again")
    written = called("controls", control.name, control.write, request, gives=Written)
    tables = _read_again(control, written)
    if odd := tables.axes - set(request.machine.axis_names):
        why = f"{control.name} reads its own files as tables for axes that the machine does not have: {sorted(odd)}"
        raise useless("controls", control.name, why, "`read` and `write` of the control must name the same axes")
    messages = linted(control, written.files)
    left = residual(request.machine, tables, request.space, request.tool_length, poses)
    _check_size(request.machine, left, request.target)
    written = replace(written, notes=(*written.notes, *_remarks(control, request, tables, left, written)))
    ranges = {
        axis.name: (round(float(low) / axis.unit, 9), round(float(high) / axis.unit, 9))
        for axis, (low, high) in zip(request.machine.axes, request.space, strict=True)
    }
    hashes = {name: digest(content) for name, content in written.files.items()}
    of_machine = request.machine.name, request.machine.hash, ranges
    made = Manifest(control.name, *of_machine, request.tool_length, dict(request.settings), hashes)
    sheet = as_markdown(control, request, tables, left, written)
    said = {"ncfix": __version__, **control.described(), "residual_um": left.figures(), "notes": written.notes}
    if request.inputs:
        said["inputs"] = dict(request.inputs)
    if written.least:
        said["least_um"] = {"max": 1e3 * written.least.value, "why": written.least.why}
    more = {SIDE_FILE: made.as_bytes(**said), f"{SHEET}.md": sheet.encode(), f"{SHEET}.html": as_html(sheet).encode()}
    reaches = control.reached(request.machine, tables)
    files = {**written.files, **more}
    return Exported(written.files, files, tables, left, written.notes, messages, written.least, reaches)


def emulate(
    control: Control, files: Files, machine: Machine, folder: str, any_machine: bool = False, poses: int = POSES
) -> Exported:
    """Run the files of a folder, with its side file, as the control would.

    any_machine  accept tables of another machine
    Raises `ConfigError` for files that the control would not load, `RefusedError` NCF487 for those of another machine.
    """
    if SIDE_FILE not in files:
        raise ConfigError.of(
            "NCF486", f"has no {SIDE_FILE}", Place(folder), "give the folder that `ncfix export` wrote"
        )
    path = f"{folder}/{SIDE_FILE}"
    made = read_manifest(files[SIDE_FILE], path)
    check_origin(made, control.name, None if any_machine else machine, path)
    native = {name: files[name] for name in made.files if name in files}
    missing = [name for name in made.files if name not in files]
    if missing:
        raise ConfigError.of("NCF486", f"these files are missing: {', '.join(missing)}", Place(folder))
    tables = _read(control, native)
    if not tables.axes <= set(machine.axis_names):
        odd = ", ".join(sorted(tables.axes - set(machine.axis_names)))
        raise RefusedError.of("NCF487", f"the tables are for axes that the machine does not have: {odd}", Place(folder))
    units = {axis.name: axis.unit for axis in machine.axes}
    ranges = {
        name: (low * units[name], high * units[name]) for name, (low, high) in made.ranges.items() if name in units
    }
    space = ranges_of(machine, ranges)
    left = residual(machine, tables, space, made.tool_length, poses)
    messages = (*made.changed(native, folder), *linted(control, native))
    same = made.hash == machine.hash and not made.changed(native, folder)
    notes, least = remarks_of(files[SIDE_FILE]) if same else ((), None)
    return Exported(native, files, tables, left, notes, messages, least, control.reached(machine, tables))


def _read(control: Control, files: Files) -> Tables:
    return called("controls", control.name, control.read, files, gives=Tables)


def _read_again(control: Control, written: Written) -> Tables:
    """Read files just written; raises `RefusedError` NCF484 if the control would not load them."""
    try:
        return _read(control, written.files)
    except ConfigError as error:
        hint = "check that all errors are in mm and rad; try a smaller range, or use ncfix fix"
        texts = (f"{each.place.path}: {each.text}" if each.place else each.text for each in error.messages)
        said = [Message("NCF484", f"the control could not be given these tables: {text}", hint=hint) for text in texts]
        raise RefusedError.collected(said) from error


def linted(control: Control, files: Files) -> tuple[Message, ...]:
    """The messages of the control's linter on files."""
    found = called("controls", control.name, control.lint, files, gives=Iterable)
    return tuple(handed("controls", control.name, each, Message) for each in found)


def _remarks(control: Control, request: Request, tables: Tables, left: Residual, written: Written) -> Iterator[str]:
    """Notes for tables of any control: lower bound, lack of effect, range covered, inputs and tool."""
    if written.least and written.least.value > request.target / 10:
        yield written.least.sentence
    before, after = (float(np.sqrt(np.mean(each**2))) for each in (left.before, left.after))
    if after > WORTH * before and before > request.target:
        yield "These tables remove almost none of the error: the format cannot hold the errors of this machine."
    machine, counted = request.machine, dict(_wrong_turn(request, tables))
    for axis, (low, high), travel in zip(machine.axes, request.space.tolist(), machine.ranges.tolist(), strict=True):
        if np.isfinite(travel).all() and (low > travel[0] + CLOSE or high < travel[1] - CLOSE):
            sizes = [f"{value / axis.unit:g}" for value in (low, high, *travel)]
            covered = f"{axis.name} from {sizes[0]} to {sizes[1]}, of a travel from {sizes[2]} to {sizes[3]}"
            yield (
                f"The tables cover {covered}. Beyond that: {control.properties.extrapolation}, and the remaining "
                "error is larger."
            )
        if axis.endless and high - low < TURN - CLOSE and axis.name not in counted:
            covered = f"{axis.name} from {low / axis.unit:g} to {high / axis.unit:g} degree"
            yield f"The tables cover {covered} of a turn; the remaining error beyond that is not known."
    for name, covered in counted.items():
        text = (
            f"{name} has no end of travel, and these tables do not repeat: they hold while the control counts it from "
        )
        text += f"{covered}. Elsewhere: {control.properties.extrapolation}"
        yield f"{text}. --range {name}=LOW,HIGH makes them for another range."
    if request.inputs:
        known = ", ".join(f"{name} = {value:g}" for name, value in request.inputs.items())
        again = (
            f"ncfix emulate --other-machine --input {next(iter(request.inputs))}=VALUE shows the remaining error at "
            "other values"
        )
        yield f"The tables hold for {known}: tables do not follow inputs. {again}."
    if not control.any_tool and not request.tool_length and machine.depends_on_tool_length:
        yield "The tables are for tool length zero: --tool-length was not given, and the error depends on it."


def _wrong_turn(request: Request, tables: Tables) -> Iterator[tuple[str, str]]:
    """Endless axes whose corrections differ one turn further: (name, covered range as text)."""
    names = request.machine.axis_names
    q = random_poses(request.space, TURNED)
    run = tables.for_tool(request.tool_length)
    weight = np.where(request.machine.rotary, LEVER, 1.0)
    for index, axis in enumerate(request.machine.axes):
        if axis.endless:
            turned = q.copy()
            turned[:, index] += TURN
            change = weight * (run.at(names, turned) - run.at(names, q))
            if np.abs(change).max() > request.target / 10:
                low, high = (float(value) / axis.unit for value in request.space[index])
                yield axis.name, f"{low:g} to {high:g} degree"


def _check_size(machine: Machine, left: Residual, target: float) -> None:
    allowed: Array = np.where(machine.rotary, machine.max_correction[1], machine.max_correction[0])
    rows = np.argmax(np.abs(left.correction), axis=0).tolist()
    for name, row, value, limit, rotary in zip(left.names, rows, left.largest, allowed, machine.rotary, strict=True):
        if value > limit:
            at = " ".join(f"{axis}{place:g}" for axis, place in left.pose(row).items())
            angles = f"{np.degrees(value):.4f} of {np.degrees(limit):.4f} degree"
            shown = angles if rotary else f"{value:.3f} of {limit} mm"
            text = f"the correction of {name} is larger than this machine allows: {shown} at {at}"
            raise RefusedError.of(
                "NCF489", text, hint="raise max_correction in the machine file, if the correction is right"
            )
    if np.mean(left.after**2) > np.mean(left.before**2) + (target / 10) ** 2:
        sizes = [f"{1e3 * float(np.sqrt(np.mean(each**2))):.3g}" for each in (left.after, left.before)]
        text = "these tables would increase the error: "
        hint = "the format cannot hold these errors; correct programs with ncfix fix"
        raise RefusedError.of("NCF490", f"{text}{sizes[0]} um rms instead of {sizes[1]}", hint=hint)
