"""The interface of a control's plugin: how its tables are made, written, read back and checked.

`Control.read` turns files into `Tables`, with the control's signs, digits, limits and rules beyond the range; running
these is the emulation. A plugin registers a function that returns its `Control` with the hook `register_controls`, so
that nothing numeric is imported before tables are asked for. Every plugin must pass `ncfix.testing.check_control`.
Settings (`--set`) are texts of a form that their `Option` states.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, field
from typing import Any, ClassVar

from ncfix.arguments import TARGET_UM, TOOL_LENGTH
from ncfix.arrays import Array
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Machine
from ncfix.plugins import called, nearest, registry, useless
from ncfix.tables.compensation import Compensation, Tables, class_of
from ncfix.tables.table_files import Remarks, check_all, messages_of
from ncfix.values import frozen

Files = Mapping[str, bytes]
"""File name (no folder) -> content."""


@frozen
class SettingForm:
    """The form of the text of a setting: `fits` tests a text, `hint` describes the form."""

    hint: str
    fits: Callable[[str], bool]


def one_of(*words: str, hint: str = "") -> SettingForm:
    """The form of a setting that is one of some words."""
    return SettingForm(hint or f"one of {', '.join(words)}", lambda text: text in words)


def whole(low: int, high: int) -> SettingForm:
    """The form of a setting that is a whole number within limits."""
    hint = f"a whole number from {low} to {high}"
    return SettingForm(hint, lambda text: text.isascii() and text.isdigit() and low <= int(text) <= high)


def number(low: float, high: float) -> SettingForm:
    """The form of a setting that is a number within limits."""

    def fits(text: str) -> bool:
        try:
            return low <= float(text) <= high
        except ValueError:
            return False

    return SettingForm(f"from {low:g} to {high:g}", fits)


def wrong_setting(settings: Mapping[str, str], key: str, hint: str) -> UsageError:
    """The error NCF485 for an invalid setting that its form alone does not exclude."""
    return UsageError.of("NCF485", f"{key}={settings[key]}", hint=hint)


@frozen
class Properties:
    """Properties of a table format.

    value_sign      "correction" (added), "error" (subtracted) or "measured" (actual position)
    input_signal    position that the tables look up: "setpoint" or "actual"
    position_frame  origin of positions
    unit            unit of values and positions
    quantum         smallest step of a value in the file, mm and rad
    extrapolation   behaviour beyond the first and last node, in words
    bidirectional   whether values depend on the direction of motion
    max_points      largest number of nodes per table
    max_tables      largest number of tables
    combine         how several tables for one axis are combined, in words
    """

    value_sign: str
    input_signal: str
    position_frame: str
    unit: str
    quantum: tuple[float, float]
    extrapolation: str
    bidirectional: bool
    max_points: int
    max_tables: int
    combine: str


@frozen
class Assumption:
    """An assumption that no public text settles, and how to verify it on the machine."""

    id: str
    text: str
    source: str
    default: str
    verify: str


@frozen
class Option:
    """A setting of a control, `--set name=value`.

    default  default value; None: the setting must be given
    text     description for people
    form     form of the text; the default is always allowed
    settled  id of the assumption that tells how to find the right value on the machine
    """

    default: str | None
    text: str
    form: SettingForm | None = None
    settled: str = ""

    def odd(self, text: str) -> bool:
        """Whether this text is invalid for the setting."""
        return self.form is not None and text != self.default and not self.form.fits(text)


@frozen
class Request:
    """A request for tables.

    machine      the machine with its errors
    space        (n_axes, 2) positions that the tables cover, mm and rad
    tool_length  tool length for which they hold, mm
    target       largest error of the tables between nodes, mm
    settings     all options of the control
    inputs       values of temperatures and other inputs that were assumed for the machine's errors

    Raises `UsageError` NCF025.
    """

    machine: Machine
    space: Array
    tool_length: float
    target: float
    settings: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        TOOL_LENGTH.check("tool_length", self.tool_length)
        TARGET_UM.check("target_um", 1e3 * self.target)


@frozen
class Least:
    """Lower bound of the largest error of any tables of a kind, mm, and the reason in words."""

    value: float
    why: str

    @property
    def sentence(self) -> str:
        """The bound as a sentence."""
        return f"With tables of this kind, at least {1e3 * self.value:.2f} um remain at the worst pose: {self.why}."


@frozen
class Written:
    """The written files of a control.

    notes  remarks on requests that could not be fulfilled
    least  lower bound of the error of any tables of this kind, if known
    """

    files: Files
    notes: tuple[str, ...] = ()
    least: Least | None = None


class Control(ABC):
    """A control with compensation tables of its own.

    name         name, as in `ncfix export NAME`
    title        name for people
    reaches      highest ISO/TR 16907 class that the tables can have; see `reached`
    properties   properties of the format
    assumptions  assumptions on which the files rest
    options      settings, `--set`
    steps        instructions at the machine, in order
    switch_off   how to deactivate the tables
    rewrites     whether it has no tables, but rewrites programs
    any_tool     whether the correction holds for tools of any length
    """

    name: ClassVar[str]
    title: ClassVar[str]
    reaches: ClassVar[str]
    properties: ClassVar[Properties]
    assumptions: ClassVar[tuple[Assumption, ...]] = ()
    options: ClassVar[Mapping[str, Option]] = {}
    steps: ClassVar[tuple[str, ...]]
    switch_off: ClassVar[str]
    rewrites: ClassVar[bool] = False
    any_tool: ClassVar[bool] = False

    @abstractmethod
    def write(self, request: Request) -> Written:
        """The native files; raises `RefusedError` NCF484 for what the format cannot hold."""

    @abstractmethod
    def read(self, files: Files) -> Tables:
        """The tables in these files, as the control applies them; raises `ConfigError` if it would not load them."""

    @abstractmethod
    def lint(self, files: Files) -> tuple[Message, ...]:
        """Messages on faults and doubtful contents of these files, with places."""

    def reached(self, machine: Machine, tables: Tables) -> str:
        """ISO/TR 16907 class of tables that were written: found for sums and products, else `reaches`."""
        rotary = [axis.name for axis in machine.axes if axis.rotary]
        return class_of(tables, rotary) if isinstance(tables, Compensation) else self.reaches

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file from elsewhere has a format of this control, by its content; see `look`."""
        return False

    def look(self, files: Files) -> tuple[Message, ...]:
        """Messages on files from elsewhere that the control `knows`.

        The set may be incomplete, and lacks the side file of ncfix.
        """
        return self.lint(files)

    def probe(self, request: Request) -> Written:
        """Small test files that show on the machine how options must be set; raises `UsageError` NCF485 if there are
        none. Options without a default may be missing in the request; they are then "".
        """
        text = f"there is no test on the machine for {self.name}"
        raise UsageError.of("NCF485", text, hint="the assumptions of the control describe how to check them")

    def settings(self, given: Mapping[str, str], complete: bool = True) -> dict[str, str]:
        """All settings, with defaults for those not given.

        Raises one `UsageError` NCF485 for all unknown, invalid or, if `complete`, missing settings.
        """
        if faults := [*self._strange(given), *(self._missing(given) if complete else ())]:
            raise UsageError.collected(faults)
        return {key: given.get(key, option.default or "") for key, option in self.options.items()}

    def _strange(self, given: Mapping[str, str]) -> Iterator[Message]:
        for key, text in given.items():
            option = self.options.get(key)
            if option is None:
                known = ", ".join(self.options) or "none"
                yield Message("NCF485", f"{self.name} has no setting {key!r}", hint=f"its settings: {known}")
            elif option.form is not None and option.odd(text):
                yield Message("NCF485", f"{key}={text}", hint=f"{option.form.hint}{self._how(option)}")

    def _missing(self, given: Mapping[str, str]) -> Iterator[Message]:
        for key, option in self.options.items():
            if option.default is None and key not in given:
                text = f"{self.name} needs the setting {key!r}: {option.text}"
                yield Message("NCF485", text, hint=f"--set {key}=VALUE{self._how(option)}")

    def _how(self, option: Option) -> str:
        """The end of a hint: how to find the right value of a setting on the machine; "" if not known."""
        found = [each.verify for each in self.assumptions if each.id == option.settled]
        return f"; find it on the machine: {found[0]}" if found else ""

    def described(self) -> dict[str, Any]:
        """Properties and assumptions as plain data."""
        return {"properties": asdict(self.properties), "assumptions": [asdict(each) for each in self.assumptions]}


class FileControl(Control):
    """A control whose `read` and `lint` share one examination of the files (`examined`)."""

    @abstractmethod
    def examined(self, files: Files) -> tuple[Tables | None, Sequence[Remarks]]:
        """The tables in these files, and remarks on each file; None only if a file has a fault."""

    def read(self, files: Files) -> Tables:
        """The tables in these files. Raises `ConfigError` NCF491."""
        tables, remarks = self.examined(files)
        check_all(remarks)
        assert tables is not None
        return tables

    def lint(self, files: Files) -> tuple[Message, ...]:
        """All remarks on these files."""
        return messages_of(self.examined(files)[1])


def controls() -> dict[str, Control]:
    """All controls of the plugins, by name."""
    return {name: _made(name, factory) for name, factory in registry("controls").items()}


def get_control(name: str) -> Control:
    """The control `name`; raises `UsageError` NCF480 if there is none."""
    found = registry("controls")
    if name not in found:
        known = found | {each: dialect for each, dialect in registry("dialects").items() if each in found}
        raise UsageError.of("NCF480", f"there are no tables for a control {name!r}", hint=nearest(name, known))
    return _made(name, found[name])


def _made(name: str, factory: Callable[[], Control]) -> Control:
    control: Control = called("controls", name, factory, gives=Control)
    needed = ("name", "title", "reaches", "properties", "steps", "switch_off")
    if absent := [each for each in needed if not hasattr(control, each)]:
        raise useless(
            "controls", name, f"the control {name!r} has no {', '.join(absent)}", "see `ncfix.plugin.Control`"
        )
    return control
