"""A tool length without a Z word is remarked on where something rests on what the control makes of it."""

from __future__ import annotations

import pytest

from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.text.reader import read

HEAD = "%\nO1\nG21 G90 G94 G17 G54\nT1 M6\nG43 H1 G0 Z50.\nG1 Z5. F100.\n"


def remarked(rest: str) -> bool:
    """Whether NCF214 is said of a program that ends so."""
    setup = Setup(tools={1: Tool(100.0)}, assume_zero=True)
    followed = trace(read((HEAD + rest).encode(), "p.nc", "fanuc"), setup, ("X", "Y", "Z"), frozenset())
    return any(message.code == "NCF214" for message in followed.messages)


@pytest.mark.parametrize(
    "rest",
    [
        "G49\nM30\n%\n",
        "G49 M9\nM5\nG53 G0 X0. Y0. Z0.\nM30\n%\n",
        "G49\nG28 G91 Z0.\nM30\n%\n",
        "G49 (off)\nT2 M6\nG0 Z80.\nX5.\nM30\n%\n",
        "G49 Z80.\nX5.\nM30\n%\n",
        "G91\nG49\nG90\nZ80.\nX5.\nM30\n%\n",
    ],
)
def test_where_z_is_named_before_anything_moves_it_does_not_matter(rest: str) -> None:
    assert not remarked(rest)


@pytest.mark.parametrize(
    "rest",
    [
        "G49\nG0 X5.\nZ80.\nM30\n%\n",
        "G49\nG91 G0 Z5.\nM30\n%\n",
        "G49\nG91\nG0 Z5.\nM30\n%\n",
        "G49\nM98 P100\nM30\nO100\nX5.\nM99\n%\n",
        "G49\n/G0 Z80.\nX5.\nM30\n%\n",
        "G49\nIF [#1 EQ 1] GOTO 9\nG0 Z80.\nN9 X5.\nM30\n%\n",
    ],
)
def test_where_something_may_move_first_it_is_remarked_on(rest: str) -> None:
    assert remarked(rest)
