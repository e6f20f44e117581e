"""Every statement of every language with subsets of its words is a motion, passes by a rule, or is named with a reason.

NCFIX_STATEMENTS says how many of each language are tried, at random; 0 tries all, which takes hours.
"""

from __future__ import annotations

import os
from collections import Counter

import pytest

from classes.statements import FAMILIES, Family, outcome
from conftest import some

COUNT = int(os.environ.get("NCFIX_STATEMENTS") or some(40))
SEED = int(os.environ.get("NCFIX_STATEMENTS_SEED", "1"))


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.dialect)
def test_nothing_that_leads_somewhere_is_passed_over(family: Family) -> None:
    found, faults = Counter[str](), []
    for case in family.some(COUNT, SEED):
        done = outcome(case)
        silent = case.leads and done.what == "nothing"
        found[done.what.partition(":")[0]] += 1
        if silent or done.what.startswith(("NCF000", "elsewhere")):
            faults.append(f"{case.block!r} behind mode {case.mode}: {done.what}")
    print(f"{family.dialect}: {dict(found)}; passed over or faults of ncfix: {len(faults)}")
    assert not faults
