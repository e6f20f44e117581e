"""Digits that belong to names and to extended addresses, found by columns and by what these are."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ncfix_siemens.sinumerik.scanning import in_names

NAME = re.compile(rb"[A-Za-z_$0-9]+")
EXTENSION = re.compile(rb"(?<![A-Za-z_$])[A-Za-z](\d+)(?=[ \t]*=)")


@given(st.lists(st.sampled_from(b"AX_$C12 =\t\n;R9"), max_size=40).map(bytes))
def test_which_digits_belong_to_names(source: bytes) -> None:
    expected = np.zeros(len(source), dtype=bool)
    for word in NAME.finditer(source):
        if re.match(rb"[A-Za-z_$]{2}", word[0]):
            expected[slice(*word.span())] = True
    for address in EXTENSION.finditer(source):
        expected[slice(*address.span(1))] = True
    text = np.frombuffer(source, dtype=np.uint8)
    digits = (text >= ord("0")) & (text <= ord("9"))
    assert (in_names(text, source) & digits).tolist() == (expected & digits).tolist()
