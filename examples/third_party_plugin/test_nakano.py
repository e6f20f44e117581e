"""The contracts of ncfix, for what this plugin brings. Run it with `pytest` in this folder."""

from ncfix_nakano import NAKANO
from ncfix_nakano.tables import NakanoPitch

from ncfix.testing import check_control, check_language


def test_the_language():
    check_language(NAKANO, count=10)


def test_the_tables():
    check_control(NakanoPitch())
