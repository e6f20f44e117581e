"""Contract tests for plugins: for a language, a control with tables, or a strategy.

`check_language(dialect)`, `check_control(control)` and `check_strategy(strategy)` raise AssertionError with the first
violations, each with the program, table or pose that shows it. They do not know the control's manual:
`check_places(dialect, program, places)` compares the positions in a program with those that you state.
"""

from ncfix.testing.judging import check_places
from ncfix.testing.language import Pair, Statements, check_language, gcode_statements
from ncfix.testing.strategy import check_strategy
from ncfix.testing.tables import check_control, single_error

__all__ = [
    "Pair",
    "Statements",
    "check_control",
    "check_language",
    "check_places",
    "check_strategy",
    "gcode_statements",
    "single_error",
]
