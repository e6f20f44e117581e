"""Following a program as the control would: from its tree to its motions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ncfix.control.following import finished
from ncfix.control.interpreter import Interpreter
from ncfix.control.moves import Kinematics, Trace
from ncfix.control.setup import Setup
from ncfix.diagnostics import UsageError
from ncfix.text.language import Run, language_of
from ncfix.text.layout import AXIS_LETTERS
from ncfix.text.tree import Program

NO_LETTER = "NCF207"


def trace(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    resolve: Callable[[str], bytes | None] | None = None,
    kinematics: Kinematics | None = None,
) -> Trace:
    """The motions of a program, in commands in mm and rad with all offsets in, in the order of execution.

    `axes` are the machine's axis letters, the columns of the motions; `rotary` those of them that turn. `resolve` gives
    the text of a subprogram file by its name (`foo` for `o<foo> call`, `100` for `M98 P100`), None if there is none.
    `kinematics` is the machine's; without it, where axes stand after tool-centre-point control goes on or off is known
    only while the rotary axes stand at zero.

    Raises SourceError NCF2xx at the first block at which the control would stop, UsageError with everything that the
    program uses and the setup does not give, and with every axis that the program moves and the machine lacks.
    """
    strangers = [axis for axis in axes if axis not in AXIS_LETTERS]
    if strangers:
        raise UsageError.of(NO_LETTER, f"the axis {strangers[0]} has no letter that a program can move")
    interpreter = interpreter_of(program, Run(setup, axes, rotary, resolve, kinematics))
    interpreter.run()
    return finished(interpreter.control, program, interpreter.moves())


def interpreter_of(program: Program, run: Run) -> Interpreter[Any]:
    """The control's walk through a program, before its first step."""
    language = language_of(program.dialect)
    return language.interpreter(language.control(run, program.dialect), program, run)
