"""What the tests of a plugin ask: does its language, its control with tables, or a strategy keep the contract?

`check_language(dialect)`, `check_control(control)` and `check_strategy(strategy)` raise AssertionError with the first
things that are wrong, each with the program, the table or the pose that shows it. They cannot know what the manual
says: `check_places(dialect, program, places)` compares where a program leads with what you state.
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
