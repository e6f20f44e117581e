"""What the tests of a plugin ask: does its language, its control with tables, or a strategy keep the contract?

`check_language(dialect)`, `check_control(control)` and `check_strategy(strategy)` raise AssertionError with the first
things that are wrong, each with the program, the table or the pose that shows it.
"""

from ncfix.testing.language import Statements as Statements
from ncfix.testing.language import check_language as check_language
from ncfix.testing.language import gcode_statements as gcode_statements
from ncfix.testing.strategy import check_strategy as check_strategy
from ncfix.testing.tables import check_control as check_control
from ncfix.testing.tables import single_error as single_error
