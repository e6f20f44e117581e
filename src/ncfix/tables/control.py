"""What a control's plugin brings: how its tables are made, written, read back and judged.

A reader turns the files into `Tables`, with the control's own signs, digits, limits and rules outside the
range worked in; running that is the emulation. A plugin registers a function that returns its `Control` with the hook
`register_controls`, so that nothing numeric is imported before tables are asked for.
`ncfix.testing.check_control` is the contract that any plugin must pass. What `--set` gives is text, of a form that its
`Option` states.
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
    """What the text of a setting may be: `fits` decides, `hint` says it."""

    hint: str
    fits: Callable[[str], bool]


def one_of(*words: str, hint: str = "") -> SettingForm:
    """One of some words."""
    return SettingForm(hint or f"one of {', '.join(words)}", lambda text: text in words)


def whole(low: int, high: int) -> SettingForm:
    """A whole number within limits."""
    hint = f"a whole number from {low} to {high}"
    return SettingForm(hint, lambda text: text.isascii() and text.isdigit() and low <= int(text) <= high)


def number(low: float, high: float) -> SettingForm:
    """A number within limits."""

    def fits(text: str) -> bool:
        try:
            return low <= float(text) <= high
        except ValueError:
            return False

    return SettingForm(f"from {low:g} to {high:g}", fits)


def wrong_setting(settings: Mapping[str, str], key: str, hint: str) -> UsageError:
    """The error for a setting that cannot be, which its form alone does not show."""
    return UsageError.of("NCF485", f"{key}={settings[key]}", hint=hint)


@frozen
class Properties:
    """What a format is, as data.

    value_sign      "correction" (added), "error" (taken off) or "measured" (where the axis really is)
    input_signal    what the tables look up: "setpoint" or "actual"
    position_frame  where positions count from
    unit            of values and positions
    quantum         smallest step of a value in the file, mm and rad
    extrapolation   beyond the first and last node
    bidirectional   whether values depend on the way an axis moves
    max_points      per table
    max_tables      in all
    combine         what several tables for one axis do
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
    """Something that no public text settles: what is taken for true, and how to find out on the machine."""

    id: str
    text: str
    source: str
    default: str
    verify: str


@frozen
class Option:
    """A setting of a control, `--set name=value`.

    default  None: it must be given
    text     what it is, for people
    form     what it may be; the default may be anything
    settled  id of the assumption that says how to find out on the machine which value is right
    """

    default: str | None
    text: str
    form: SettingForm | None = None
    settled: str = ""

    def odd(self, text: str) -> bool:
        """Whether the control has no use for this text."""
        return self.form is not None and text != self.default and not self.form.fits(text)


@frozen
class Request:
    """What to make tables of.

    machine      with its errors
    space        (n_axes, 2) the positions that the tables cover, mm and rad
    tool_length  the length for which they hold, mm
    target       how much correction may be lost between nodes, mm
    settings     the control's options, all of them
    inputs       what temperatures and the like were taken to be for the machine's errors

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
    """No tables of this kind leave less than `value` (mm) at the worst; `why`, in words."""

    value: float
    why: str

    @property
    def sentence(self) -> str:
        """For people."""
        return f"No tables of this kind can leave less than {1e3 * self.value:.2f} um at the worst: {self.why}."


@frozen
class Written:
    """The files of a control.

    notes  what could not be done as asked, in words
    least  what no tables of this kind could do better, if that is known
    """

    files: Files
    notes: tuple[str, ...] = ()
    least: Least | None = None


class Control(ABC):
    """A control with compensation tables of its own.

    name         as in `ncfix export NAME`
    title        for people
    reaches      ISO/TR 16907 class of what the tables can correct at best; see `reached`
    properties   of the format
    assumptions  that the files rest on
    options      `--set`
    steps        what to do at the machine, in order
    switch_off   how to be rid of it
    rewrites     it has no tables, but programs that are rewritten
    any_tool     what it does holds for tools of any length
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
        """What the control does with these files; raises `ConfigError` for files that it would not load."""

    @abstractmethod
    def lint(self, files: Files) -> tuple[Message, ...]:
        """What is wrong or doubtful in these files, each with its place; empty if nothing is."""

    def reached(self, machine: Machine, tables: Tables) -> str:
        """The class of what was written: of sums and products of tables it shows in them, of others it is `reaches`."""
        rotary = [axis.name for axis in machine.axes if axis.rotary]
        return class_of(tables, rotary) if isinstance(tables, Compensation) else self.reaches

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file from elsewhere is of a form of this control, by what it holds; see `look`."""
        return False

    def look(self, files: Files) -> tuple[Message, ...]:
        """What is wrong or doubtful in files from elsewhere, all of forms that it knows.

        There may be only some of a set, and nothing of what ncfix writes beside its own files.
        """
        return self.lint(files)

    def probe(self, request: Request) -> Written:
        """Small files that settle on the machine what must be said in options; raises `UsageError` NCF485 if none do.

        Options without a default may be missing in the request; they are empty then.
        """
        text = f"there is nothing to probe for {self.name}"
        raise UsageError.of("NCF485", text, hint="its assumptions say how to check them")

    def settings(self, given: Mapping[str, str], complete: bool = True) -> dict[str, str]:
        """All options with those given.

        All that are unknown, of another form or, if `complete`, missing are named in one `UsageError` NCF485.
        """
        if faults := [*self._strange(given), *(self._missing(given) if complete else ())]:
            raise UsageError.collected(faults)
        return {key: given.get(key, option.default or "") for key, option in self.options.items()}

    def _strange(self, given: Mapping[str, str]) -> Iterator[Message]:
        for key, text in given.items():
            option = self.options.get(key)
            if option is None:
                known = ", ".join(self.options) or "none"
                yield Message("NCF485", f"{self.name} has no option {key!r}", hint=f"its options: {known}")
            elif option.form is not None and option.odd(text):
                yield Message("NCF485", f"{key}={text}", hint=f"{option.form.hint}{self._how(option)}")

    def _missing(self, given: Mapping[str, str]) -> Iterator[Message]:
        for key, option in self.options.items():
            if option.default is None and key not in given:
                text = f"{self.name} needs the option {key!r}: {option.text}"
                yield Message("NCF485", text, hint=f"--set {key}=VALUE{self._how(option)}")

    def _how(self, option: Option) -> str:
        """How to find out on the machine what a setting must be."""
        found = [each.verify for each in self.assumptions if each.id == option.settled]
        return f"; on the machine: {found[0]}" if found else ""

    def described(self) -> dict[str, Any]:
        """Properties and assumptions as plain data."""
        return {"properties": asdict(self.properties), "assumptions": [asdict(each) for each in self.assumptions]}


class FileControl(Control):
    """A control whose files are looked at once: it loads those in which nothing is wrong, and lints by all remarks."""

    @abstractmethod
    def examined(self, files: Files) -> tuple[Tables | None, Sequence[Remarks]]:
        """What the control does with these files, and remarks on each; None only where something is wrong."""

    def read(self, files: Files) -> Tables:
        """What the control does with these files. Raises `ConfigError` NCF491."""
        tables, remarks = self.examined(files)
        check_all(remarks)
        assert tables is not None
        return tables

    def lint(self, files: Files) -> tuple[Message, ...]:
        """What the control would not load or would misread, and what is rarely meant."""
        return messages_of(self.examined(files)[1])


def controls() -> dict[str, Control]:
    """All controls that plugins bring."""
    return {name: _made(name, factory) for name, factory in registry("controls").items()}


def get_control(name: str) -> Control:
    """The control of that name; raises `UsageError` NCF480."""
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
