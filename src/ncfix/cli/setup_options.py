"""Options for data that a program cannot contain: work offsets, tools, start position."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import fields, replace
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from ncfix.arguments import OFFSET_AXES, WORK_OFFSET
from ncfix.cli.console import tell
from ncfix.cli.options import PATH
from ncfix.diagnostics import Message, Place
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine

AXIS = re.compile(r"[XYZABCUVW]")
BOTH = "both"
"""Value for all positions of block delete."""


class KeyValue(click.ParamType):  # type: ignore[type-arg]
    """`KEY=VALUE`; `convert_value` converts the value, or raises ValueError with the reason.

    upper   case means nothing in a key; `blanks`: blanks do
    """

    def __init__(
        self, metavar: str, convert_value: Callable[[str, str], Any], upper: bool = True, blanks: bool = True
    ) -> None:
        self.name = metavar
        self.convert_value = convert_value
        self.upper, self.blanks = upper, blanks

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The key, in upper case unless case matters, and the value."""
        key, equals, text = str(value).partition("=")
        key = key.strip() if self.blanks else "".join(key.split())
        key = key.upper() if self.upper else key
        if not equals:
            self.fail(f"{value!r} has no =; write it like {self.name}", param, ctx)
        try:
            return key, self.convert_value(key, text)
        except ValueError as error:
            self.fail(f"{value!r}: {error}; it reads like {self.name}", param, ctx)


def number(text: str) -> float:
    """A finite number with a decimal point."""
    try:
        found = float(text.replace("_", "?"))
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise ValueError(f"{text.strip()!r} is not a number")
    return found


def offset_values(name: str, text: str) -> dict[str, float]:
    """A work offset by axis letter, from `0,0,-300` or `X0,Z-300`."""
    parts = [part.strip() for part in text.split(",")]
    if not WORK_OFFSET.fullmatch(name):
        raise ValueError(f"{name} is not a work offset")
    if all(AXIS.match(part.upper()) for part in parts):
        letters = [part[0].upper() for part in parts]
        if len(set(letters)) < len(letters):
            raise ValueError("an axis is named twice")
        return {letter: number(part[1:].removeprefix("=")) for letter, part in zip(letters, parts, strict=True)}
    if not 1 <= len(parts) <= len(OFFSET_AXES):
        raise ValueError(f"{len(parts)} numbers, but there are at most {len(OFFSET_AXES)} axes")
    return dict(zip(OFFSET_AXES, map(number, parts), strict=False))


def tool_values(name: str, text: str) -> tuple[float, ...]:
    """The length of a tool, and its radius if given."""
    if (len(name) < 2 and not name.isdecimal()) or re.fullmatch(r"T\d+|[-+][\d.]+", name):
        raise ValueError(f"{name!r} is neither a tool number nor a tool name")
    values = tuple(map(number, text.split(",")))
    if len(values) > 2:
        raise ValueError("give a length, or a length and a radius")
    if len(values) == 2 and "." not in text:
        one, both = text.replace(",", "."), text.replace(",", ".0,")
        raise ValueError(f"{text!r} may have a decimal comma: {one} is a length, {both}.0 a length and a radius")
    return values


class AxisValues(click.ParamType):  # type: ignore[type-arg]
    """`X=0,Z=300`: positions by axis letter."""

    name = "X=0,Z=300"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Axis letter -> position."""
        found: dict[str, float] = {}
        for part in str(value).split(","):
            letter, equals, text = part.strip().upper().partition("=")
            try:
                if not equals or not AXIS.fullmatch(letter):
                    raise ValueError(f"{part.strip()!r} is not an axis and a number")
                if letter in found:
                    raise ValueError(f"axis {letter} is given twice")
                found[letter] = number(text)
            except ValueError as error:
                self.fail(f"{value!r}: {error}; it reads like {self.name}", param, ctx)
        return found


class Switches(click.ParamType):  # type: ignore[type-arg]
    """`on`, `off`, `both`, or the numbers of switches: `2,3`."""

    name = "both|on|off|2,3"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """True, False, `BOTH`, or the numbers of the switches that are on."""
        said = {"on": True, "off": False, BOTH: BOTH}.get(str(value).strip().lower())
        if said is not None or not isinstance(value, str):
            return value if said is None else said
        parts = [part.strip().removeprefix("/") for part in value.split(",")]
        if not all(re.fullmatch(r"[0-9]", part) for part in parts):
            self.fail(f"{value!r} is none of on, off and both, and no list of switch numbers like 2,3", param, ctx)
        return frozenset(map(int, parts))


OPTIONS = (
    click.option(
        "--setup",
        "setup_file",
        type=PATH,
        metavar="FILE",
        envvar="NCFIX_SETUP",
        help="Setup file with work offsets, tools and start position (TOML).",
    ),
    click.option(
        "--offset",
        "offsets",
        type=KeyValue("G54=0,0,-300", offset_values, blanks=False),
        multiple=True,
        help="Work offset in the order X Y Z A B C, mm and degrees (repeatable).",
    ),
    click.option(
        "--tool",
        "tools",
        type=KeyValue("12=120.0", tool_values),
        multiple=True,
        help="Length of a tool, mm; with radius: 12=120.0,5.0 (repeatable).",
    ),
    click.option("--tool-table", "tool_table", type=PATH, metavar="FILE", help="Tool table of the control."),
    click.option(
        "--tool-unit",
        type=click.Choice(("mm", "inch")),
        metavar="[mm|inch]",
        help="Unit of a tool table that does not state it; default: mm.",
    ),
    click.option(
        "--initial",
        type=AxisValues(),
        multiple=True,
        help="Start position of axes, machine coordinates, mm and degrees (repeatable).",
    ),
    click.option(
        "--input",
        "inputs",
        type=KeyValue("temp_spindle=24.5", lambda key, text: number(text), upper=False),
        multiple=True,
        metavar="temp_spindle=24.5",
        help="Value of an input of the error model, e.g. a temperature in degrees C (repeatable).",
    ),
    click.option(
        "--no-point",
        type=click.Choice(("calculator", "IS-A", "IS-B", "IS-C"), case_sensitive=False),
        metavar="[calculator|IS-A|IS-B|IS-C]",
        help="Meaning of a number without decimal point: mm or inch (calculator), or least increments (IS-B: X50 is "
        "0.050 mm).",
    ),
    click.option(
        "--subprograms",
        type=click.Path(exists=True, file_okay=False),
        multiple=True,
        metavar="DIR",
        help="Folder with subprograms, besides that of the program (repeatable).",
    ),
    click.option(
        "--probed",
        type=AxisValues(),
        multiple=True,
        help="Nominal end of probing, program coordinates; its results then count as known (repeatable).",
    ),
    click.option(
        "--block-skip",
        type=Switches(),
        metavar="[both|on|off|2,3]",
        help="Position of the block delete switches: on (blocks with / are skipped), off, both (default: right in "
        "every position), or the numbers of the switches that are on.",
    ),
    click.option(
        "--assume-zero",
        is_flag=True,
        help="Take offsets, tool lengths and start positions that are not given as zero, with a warning for each.",
    ),
)


@frozen
class SetupOptions:
    """The setup as given by options."""

    setup_file: str | None = None
    offsets: tuple[tuple[str, dict[str, float]], ...] = ()
    tools: tuple[tuple[str, tuple[float, ...]], ...] = ()
    tool_table: str | None = None
    tool_unit: str | None = None
    initial: tuple[dict[str, float], ...] = ()
    inputs: tuple[tuple[str, float], ...] = ()
    no_point: str | None = None
    assume_zero: bool = False
    subprograms: tuple[str, ...] = ()
    probed: tuple[dict[str, float], ...] = ()
    block_skip: str | bool | frozenset[int] | None = None

    @property
    def files(self) -> tuple[str | None, str | None]:
        """The files that are read."""
        return self.setup_file, self.tool_table

    def load(self, machine: Machine | None = None) -> Setup:
        """The setup: from the file, then the tool table, then single options; later ones override earlier ones.

        Raises errors in the files, and `UsageError` NCF384 for work offsets in the order of the axes of `machine`.
        """
        from ncfix.control.setup import Setup, Tool, check_offsets

        setup = Setup()
        if self.setup_file is not None:
            from ncfix.control.setup_file import load

            setup = load(self.setup_file)
        tools, named = dict(setup.tools), dict(setup.named_tools)
        if self.tool_table is not None:
            from ncfix.control.tool_files.tables import OTHER_AXES, load_tool_table, may_be_in_inches

            axes = OTHER_AXES if machine is None else machine.axis_names
            found = load_tool_table(self.tool_table, axes, self.tool_unit or "mm")
            if self.tool_unit is None and (doubt := may_be_in_inches(found)):
                tell(Message("NCF386", doubt, Place(self.tool_table), "give --tool-unit inch or --tool-unit mm"))
            tools |= {key: tool for key, tool in found.items() if isinstance(key, int)}
            named |= {key: tool for key, tool in found.items() if isinstance(key, str)}
        given = {key.strip('"'): Tool(values[0], values[1] if len(values) > 1 else None) for key, values in self.tools}
        tools |= {int(key): tool for key, tool in given.items() if key.isdecimal()}
        named |= {key: tool for key, tool in given.items() if not key.isdecimal()}
        probed = {axis: value for given in self.probed for axis, value in given.items()}
        stated = self.block_skip
        whole = replace(
            setup,
            work_offsets={**setup.work_offsets, **dict(self.offsets)},
            tools=tools,
            named_tools=named,
            initial={**setup.initial, **{axis: value for given in self.initial for axis, value in given.items()}},
            inputs={**setup.inputs, **dict(self.inputs)},
            no_point=self.no_point or setup.no_point,
            assume_zero=setup.assume_zero or self.assume_zero,
            subprograms=(*self.subprograms, *setup.subprograms),
            probed={**(setup.probed or {}), **probed} if self.probed else setup.probed,
            block_skip=setup.block_skip if stated is None else None if isinstance(stated, str) else stated,
        )
        if machine is not None:
            check_offsets(whole, machine.axis_names, {name for name, _ in self.offsets})
        return whole


def setup_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds these options to a verb, which gets them as one argument `given`."""

    @wraps(command)
    def with_given(*arguments: Any, **options: Any) -> Any:
        given = SetupOptions(**{field.name: options.pop(field.name) for field in fields(SetupOptions)})
        return command(*arguments, given=given, **options)

    for option in reversed(OPTIONS):
        with_given = option(with_given)
    return with_given
