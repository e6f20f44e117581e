"""A machine file with a bit of everything, and what is said of one that is wrong."""

from __future__ import annotations

import pytest

from ncfix.diagnostics import ConfigError, ExitCode, Message
from ncfix.machine import loads
from ncfix.machine.codes import CODES

GOOD = """\
ncfix = 1                         # schema version
name = "DMU 50 eVolution"
topology = "w C B F X Y Z t"
control = "heidenhain"
least_increment = { linear = 0.001, rotary = 0.002 }
max_correction = { linear = 0.25, rotary = 0.1 }

[axis.X]
type = "linear"
direction = [1, 0, 0]
range = [0, 500]
pitch = 10.0

[axis.Y]
type = "linear"
direction = [0, 2, 0]

[axis.Z]
type = "linear"
direction = [0, 0, 1]
range = [-400, 0]

[axis.B]
type = "rotary"
direction = [0, -0.7071067811865476, 0.7071067811865476]
point = [0, 0, 154.996]
range = [0, 180]
error_axes = [[1, 0, 0], [0, 0.70710678, 0.70710678], [0, -0.70710678, 0.70710678]]
error_frame = "moving"

[axis.C]
type = "rotary"
direction = [0, 0, -1]

[tool]
direction = [0, 0, 1]
point = [0, 0, 120]

[[effect]]
name = "EXX"
basis = "polynomial"
degree = [1, 2, 3]
center = 250.0
scale = 250.0
coefficients = [0.0103, -0.0021, 0.0004]
covariance = [[4e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]]
reference = [0, 0, -275.86]

[[effect]]
name = "EC0Y"
coefficients = [12e-6]

[[effect]]
name = "EZS"
basis = "polynomial"
degree = [1]
input = "temp_spindle"
time_constant_s = 1800
coefficients = [0.0006]

[provenance]
date = 2026-11-21
source = "laser-tracker-2026-11.csv"
nested = { runs = [1, 2], "odd key" = true }
"""


def faults(text: str) -> tuple[Message, ...]:
    """The messages on a machine file that is wrong."""
    with pytest.raises(ConfigError) as caught:
        loads(text, "m.toml")
    assert caught.value.exit_code is ExitCode.UNREADABLE
    assert all(message.code in CODES for message in caught.value.messages)
    return caught.value.messages


def changed(old: str, new: str) -> str:
    """The good file with one place changed."""
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)
