"""The thesis's table schemes do what it reports, the corrected Eq. 59 holds, and the automatic scheme does better."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ncfix.diagnostics import RefusedError
from ncfix.machine import State
from ncfix.tables.exact import exact_correction
from ncfix.tables.poses import ranges_of
from ncfix.tables.scheme import Job, Limits
from ncfix.tables.scheme_fixed import fixed
from ncfix.tables.scheme_rotary import rotary_correction
from validation import table_schemes as study


@pytest.fixture(scope="module")
def cases() -> dict[str, study.Case]:
    return {case.name: case for case in study.ten_cases()}


def test_the_ten_cases_follow_the_printed_pattern(cases: dict[str, study.Case], figures: Callable[[str], None]) -> None:
    """Chapter 6: polynomials take EY0C, EA0C, EA0Z and the gains off, and the other five in part; 23 tables all."""
    figures("error: um before, then auto / 25Poly-T / 23Trigo-T; per cent taken off; printed in Table 6-6")
    for name, case in cases.items():
        sizes = " / ".join(f"{case.after[scheme]:.2f}" for scheme in study.SCHEMES)
        shares = " / ".join(f"{case.effectiveness(scheme):.0f}" for scheme in study.SCHEMES)
        figures(f"{name}: {case.before:.1f}, {sizes}; {shares}; {' / '.join(map(str, study.TABLE_6_6[name]))}")
    partly = {"EB0A", "EC0A", "EB0C", "EC0X", "EB0Z"}
    for name, case in cases.items():
        assert case.effectiveness("auto") > 99
        assert case.effectiveness("trigo23") > 99
        assert (case.effectiveness("poly25") < 80) == (name in partly)
        assert case.effectiveness("poly25") > 0


def test_all_ten_errors_together_come_near_the_printed_means(figures: Callable[[str], None]) -> None:
    """Table 6-7 in shares of what there was before: 5, 38 and 7 per cent. Places of the ball are not printed."""
    found = study.all_ten()
    figures("; ".join(f"{name} {mean:.1f}/{most:.1f} um" for name, (mean, most) in found.items()))
    before = found["before"][0]
    assert 0.08 < found["auto"][0] / before < 0.16  # the errors have changed by that much between 6-4 and 6-5
    assert 0.3 < found["poly25"][0] / before < 0.6
    assert found["trigo23"][0] / before < 0.16


@pytest.mark.parametrize("name", study.TABLE_7_2)
def test_the_corrected_equation_59_is_what_the_model_gives(name: str) -> None:
    """To second order in the errors: 0.1 mrad at half a metre is 5 nm."""
    machine = study.huron({name: study.TABLE_7_2[name]})
    q = study.lever_poses(machine)
    state = State(study.TOOL)
    start = np.zeros_like(q)
    start[:, machine.rotary] = rotary_correction(machine, q, state)
    correction = exact_correction(machine, q, state, start)
    columns = [machine.axis_names.index(letter) for letter in "XYZAC"]
    printed = study.TABLE_7_2[name] * study.equation_59(q, machine.axis_names, study.TOOL, name)
    np.testing.assert_allclose(-correction[:, columns], printed, atol=5e-6)


def test_the_automatic_scheme_needs_20_tables_for_the_13_errors(figures: Callable[[str], None]) -> None:
    run = study.thirteen("auto")
    figures(
        f"13 errors, automatic: {run.tables} tables, {run.before:.1f} -> {run.after:.3f} um mean (printed: 44 -> 9.1)"
    )
    assert run.before == pytest.approx(44, abs=1)
    assert run.after < 0.1
    assert run.tables <= 20


@pytest.mark.parametrize(("scheme", "tables"), [("fik40", 40), ("fik20", 20), ("trigo23", 23), ("poly25", 25)])
def test_the_schemes_have_the_tables_that_their_names_say(scheme: str, tables: int) -> None:
    """13 + 11 + 14 + 1 + 1 = 40 of the thesis, and 6 + 6 + 6 + 1 + 1 = 20 that do the same."""
    run = study.thirteen(scheme)
    assert run.tables == tables
    assert run.after < (20 if scheme == "poly25" else 0.1)


def test_forward_inverse_tables_are_for_their_chain_only() -> None:
    machine = study.kolibri()
    other = machine.replace(axes=(machine.axes[1], machine.axes[0], *machine.axes[2:]), topology="w A C Y F X Z S t")
    with pytest.raises(RefusedError) as caught:
        fixed(Job(other, ranges_of(other), 0.0, 1e-3, Limits(40, 500)), "fik20")
    assert caught.value.code == "NCF484"


def test_eight_tables_take_off_most(figures: Callable[[str], None]) -> None:
    """828D: 8 tables of 200 points."""
    run = study.thirteen("auto", 1e-3, Limits(8, 200))
    figures(f"13 errors, 8 tables: {run.before:.1f} -> {run.after:.1f} um mean")
    assert run.tables <= 8
    assert run.after < run.before / 3
