"""The contracts of ncfix, for what this plugin brings. Run it with `pytest` in this folder."""

from ncfix_nakano import NAKANO
from ncfix_nakano.tables import NakanoPitch

from ncfix.testing import check_control, check_language, check_places

EXAMPLE = """G21 G90 G54 G100 T1 X10. Y20. Z50.
G43 H1 Z30.
G177 X5. Y6. Z-5. E2. Q1. F100.
X7.
G80
G168 X1. Y0. Z0. A0. B0. C90.
G0 X2. Y3. Z40.
G199
G1 X1.
"""


def test_the_language():
    check_language(NAKANO, count=10)


def test_the_example_of_the_manual():
    hole, turned = {"X": 7, "Y": 6, "Z": -5 + 20}, {"X": 1 - 3, "Y": 2, "Z": 40}
    check_places(NAKANO, EXAMPLE, {1: {"X": 10, "Y": 20, "Z": 50}, 2: {"Z": 50}, 4: hole, 7: turned, 9: None})


def test_the_tables():
    check_control(NakanoPitch())
