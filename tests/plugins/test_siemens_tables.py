"""Siemens CEC and EEC: to the byte, as the manual says that the control takes them, and what the linter says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from ncfix.diagnostics import RefusedError, UsageError
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import Exported, export
from ncfix.tables.table_files import Remarks
from ncfix.testing import check_control, single_error
from ncfix_siemens.assignments import ArrayAssignment, assignments, parsed, written
from ncfix_siemens.products import TableReading, compensation
from ncfix_siemens.settings import PROBE_READINGS, TERMS
from ncfix_siemens.tables import CecStyle, CecTable, cec_text, read_cec
from tables.siemens_files import CONTROL, EEC, GOOD, PAIR, at

MACHINES = Path(__file__).resolve().parents[2] / "examples" / "machines"
SETTINGS = {"value_sign": "error", "product_terms": "only"}


def made(machine: Machine, length: float = 0.0, target: float = 1e-4, **settings: str) -> Exported:
    request = Request(machine, ranges_of(machine), length, target, CONTROL.settings({**SETTINGS, **settings}))
    return export(CONTROL, request, 500)


# -- writing -----------------------------------------------------------------------------------------------------------


def test_golden_bytes_of_a_table_that_is_added() -> None:
    """X stands 0.010 mm too far everywhere: as an error that is what the two values say."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    assert made(machine).native == {
        "NC_CEC.INI": b"%_N_NC_CEC_INI\nCHANDATA(1)\n"
        b"; ncfix: value_sign=error product_terms=only X=AX1 Y=AX2 Z=AX3 most_tables=40 most_points=1000\n"
        b"; assumptions SIEMENS-1 to SIEMENS-7: see hand-over.md\n"
        b"; table 1: X over X\n$AN_CEC[0,0]=0.01\n$AN_CEC[0,1]=0.01\n"
        b"$AN_CEC_INPUT_AXIS[0]=(AX1)\n$AN_CEC_OUTPUT_AXIS[0]=(AX1)\n"
        b"$AN_CEC_STEP[0]=500.0\n$AN_CEC_MIN[0]=-200.0\n$AN_CEC_MAX[0]=300.0\n"
        b"$AN_CEC_DIRECTION[0]=0\n$AN_CEC_MULT_BY_TABLE[0]=0\n$AN_CEC_IS_MODULO[0]=0\nM17\n"
    }


def test_golden_bytes_of_a_pair() -> None:
    base = CecTable(0, "AX1", "AX2", -10.0, 20.0, np.array([-0.5, 0.5]), direction=-1, multiply=2)
    multiplier = CecTable(1, "AX4", "AX2", 0.0, 120.0, np.array([0.0, 0.8660254, -0.8660254, 0.0]), modulo=True)
    style = CecStyle(brackets=False, metric=True, path="/_N_CUS_DIR")
    assert cec_text([base, multiplier], ["made by hand"], {1: "sine"}, style) == (
        b"%_N_NC_CEC_INI\n;$PATH=/_N_CUS_DIR\nMETRIC\nCHANDATA(1)\n; made by hand\n"
        b"$AN_CEC[0,0]=-0.5\n$AN_CEC[0,1]=0.5\n$AN_CEC_INPUT_AXIS[0]=AX1\n$AN_CEC_OUTPUT_AXIS[0]=AX2\n"
        b"$AN_CEC_STEP[0]=20.0\n$AN_CEC_MIN[0]=-10.0\n$AN_CEC_MAX[0]=10.0\n"
        b"$AN_CEC_DIRECTION[0]=-1\n$AN_CEC_MULT_BY_TABLE[0]=2\n$AN_CEC_IS_MODULO[0]=0\n"
        b"; sine\n$AN_CEC[1,0]=0.0\n$AN_CEC[1,1]=0.8660254\n$AN_CEC[1,2]=-0.8660254\n$AN_CEC[1,3]=0.0\n"
        b"$AN_CEC_INPUT_AXIS[1]=AX4\n$AN_CEC_OUTPUT_AXIS[1]=AX2\n"
        b"$AN_CEC_STEP[1]=120.0\n$AN_CEC_MIN[1]=0.0\n$AN_CEC_MAX[1]=360.0\n"
        b"$AN_CEC_DIRECTION[1]=0\n$AN_CEC_MULT_BY_TABLE[1]=0\n$AN_CEC_IS_MODULO[1]=1\nM17\n"
    )


def test_golden_bytes_of_an_encoder_table() -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    files = made(machine, positioning="eec", axes="X:X1,Y:Y1,Z:Z1").native
    assert files == {
        "X1_EEC.INI": b"%_N_X1_EEC_INI\nCHANDATA(1)\n"
        b"; ncfix: value_sign=error product_terms=only X=X1 Y=Y1 Z=Z1 most_tables=40 most_points=1000\n"
        b"; assumptions SIEMENS-1 to SIEMENS-7: see hand-over.md\n"
        b"$AA_ENC_COMP[0,0,X1]=0.01\n$AA_ENC_COMP[0,1,X1]=0.01\n$AA_ENC_COMP_STEP[0,X1]=500.0\n"
        b"$AA_ENC_COMP_MIN[0,X1]=-200.0\n$AA_ENC_COMP_MAX[0,X1]=300.0\n$AA_ENC_COMP_IS_MODULO[0,X1]=0\nM17\n"
    }


def test_encoder_tables_take_what_is_an_axis_over_itself_and_the_others_the_rest() -> None:
    machine = single_error("ECX", 20e-6)
    machine = machine.replace(effects=(*machine.effects, *single_error("EYY").effects, *single_error("EZZ").effects))
    found = made(machine, positioning="eec", value_sign="correction")
    assert set(found.native) == {"NC_CEC.INI", "AX2_EEC.INI", "AX3_EEC.INI"}
    tables = read_cec(parsed(found.native["NC_CEC.INI"].decode()), Remarks(""))
    pointed = {table.multiply for table in tables}
    added = [table for table in tables if not table.multiply and table.index + 1 not in pointed]
    assert all(table.input != table.output for table in added)
    assert not found.messages
    assert found.left.after.max() < 2e-4


def test_rotary_axes_keep_their_values_where_the_machine_does_not_allow_so_much() -> None:
    """0.001 rad are 0.057 degree, and 0.05 are allowed."""
    machine = load(str(MACHINES / "wCAYFXZSt.toml")).replace(effects=(Effect("EA0C", (0.001,), carried=True),))
    with pytest.raises(RefusedError) as caught:
        made(machine, rotary="correct", target=1e-3)
    assert caught.value.code == "NCF489"
    kept = made(machine.replace(max_correction=(1.0, 0.05 * np.pi / 180)), target=1e-3)
    assert any("keep their values" in note for note in kept.notes)
    assert kept.left.after.max() < 0.05 * kept.left.before.max()


@pytest.mark.parametrize(("sign", "terms"), [("error", "only"), *([("correction", "plus_both")] if FULL else [])])
def test_the_contract(sign: str, terms: str) -> None:
    check_control(CONTROL, {"value_sign": sign, "product_terms": terms})


def test_the_contract_with_encoder_tables_and_few_tables() -> None:
    check_control(CONTROL, {**SETTINGS, "positioning": "eec", "model": "828D"})


@pytest.mark.parametrize("name", ["EC0S", "EB0A", "ECC"])
def test_rotary_axes_turn_for_the_orientation_only_if_the_tip_stays_right(name: str) -> None:
    """The spin of the tool (EC0S) does not move its tip: turning C for it could only do harm there."""
    cradle = load(str(MACHINES / "wCAYFXZSt.toml"))
    left = made(cradle.replace(effects=(Effect(name, (30e-6,)),)), 120.0, 1e-3).left
    assert left.after.max() <= max(0.2 * left.before.max(), 1e-6)


@pytest.mark.parametrize("effect", [f"E{component}{axis}" for axis in "XYZ" for component in "XYZABC"])
def test_every_single_error_goes_away(effect: str) -> None:
    """Sums and products of pairs say any error of a three-axis machine: what is left is digits and nodes."""
    size = 20e-6 if effect[1] in "ABC" else 0.01
    for topology in ("w F X Y Z t", "w Y X F Z t"):
        left = made(single_error(effect, size, topology), 100.0).left
        assert left.after.max() < 2e-4
        assert left.after.max() < 0.05 * max(left.before.max(), 0.005)


def test_only_one_factor_of_a_pair_turns_with_the_sign() -> None:
    machine = single_error("ECX", 20e-6)
    one, other = (made(machine, value_sign=sign) for sign in ("error", "correction"))
    first, second = (read_cec(parsed(each.native["NC_CEC.INI"].decode()), Remarks("")) for each in (one, other))
    assert sum(bool(table.multiply) for table in first) == 1
    for a, b in zip(first, second, strict=True):
        turned = a.index + 1 not in {table.multiply for table in first}
        assert (a.values == (-b.values if turned else b.values)).all()
    assert (one.left.after == other.left.after).all()


def test_factors_are_about_equally_large_and_do_little_harm_alone() -> None:
    tables = read_cec(parsed(made(single_error("ECX", 200e-6)).native["NC_CEC.INI"].decode()), Remarks(""))
    sizes = [float(np.abs(table.values).max()) for table in tables]
    assert max(sizes) < 0.5
    assert max(sizes) / min(sizes) < 1.1


def test_what_changes_with_the_way_becomes_tables_for_each_way() -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.004,), Backlash((0,))),))
    found = made(machine)
    tables = read_cec(parsed(found.native["NC_CEC.INI"].decode()), Remarks(""))
    assert [(table.direction, table.input) for table in tables] == [(1, "AX1"), (-1, "AX1")]
    assert any("MD32450" in note for note in found.notes)
    assert found.left.before.max() == pytest.approx(0.002)
    assert found.left.after.max() < 1e-7  # digits of the file


def test_angles_that_change_with_the_way_are_products_for_each_way() -> None:
    machine = single_error("ECX").replace(effects=(Effect("ECX", (40e-6,), Backlash((0,))),))
    found = made(machine)
    tables = read_cec(parsed(found.native["NC_CEC.INI"].decode()), Remarks(""))
    assert sorted(table.direction for table in tables if table.multiply) == [-1, 1]
    assert found.left.after.max() < 1e-5
    assert found.left.before.max() > 0.004


# -- reading -----------------------------------------------------------------------------------------------------------


def test_linear_between_and_held_beyond() -> None:
    files = {"NC_CEC.INI": GOOD}
    assert at(files, Y=-100)[0] == pytest.approx(-0.001)
    assert at(files, Y=-75)[0] == pytest.approx(-0.002)
    assert at(files, Y=-999)[0] == pytest.approx(-0.001)
    assert at(files, Y=999)[0] == pytest.approx(-0.002)


def test_the_sign_is_that_of_the_comment() -> None:
    files = {"NC_CEC.INI": GOOD.replace(b"value_sign=error", b"value_sign=correction")}
    assert at(files, Y=-100)[0] == pytest.approx(0.001)


def test_a_direction_acts_that_way_of_the_input_axis_only() -> None:
    files = {"NC_CEC.INI": GOOD.replace(b"DIRECTION[0]=0", b"DIRECTION[0]=-1")}
    assert at(files, (1, -1, 1), Y=0)[0] == pytest.approx(-0.002)
    assert at(files, (-1, 1, -1), Y=0)[0] == 0


def test_modulo_repeats() -> None:
    turning = GOOD.replace(b"MODULO[0]=0", b"MODULO[0]=1").replace(b"[0,2]=0.002", b"[0,2]=0.001")
    assert at({"NC_CEC.INI": turning}, Y=25)[0] == pytest.approx(-0.002)


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ("only", 0.003 * 0.15),
        ("plus_multiplier", 0.003 * 0.15 + 0.15),
        ("plus_base", 0.003 * 0.15 + 0.003),
        ("plus_both", 0.003 * 0.15 + 0.003 + 0.15),
    ],
)
def test_what_a_product_adds(terms: str, expected: float) -> None:
    files = {"NC_CEC.INI": PAIR.replace(b"terms=only", b"terms=" + terms.encode())}
    assert at(files, Y=-50, Z=50)[0] == pytest.approx(-expected)


def test_encoder_values_are_errors_whatever_the_sign_of_the_others() -> None:
    files = {"AX1_EEC.INI": EEC, "NC_CEC.INI": GOOD.replace(b"value_sign=error", b"value_sign=correction")}
    assert at(files, X=-150, Y=-100)[0] == pytest.approx(-0.0065 + 0.001)


# -- the samples that are public ---------------------------------------------------------------------------------------

SAMPLES = ("cec_802Dsl_manual_example", "cec_fig73_seed001", "cec_mult_probe_RECONSTRUCTED", "eec_manual_example")


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_are_read_and_written_again_identically(shared: Callable[[str], Path], name: str) -> None:
    text = (shared("tables") / "siemens" / f"{name}.ini").read_bytes().decode("latin-1")
    lines = parsed(text)
    assert written(lines) == text
    remarks = Remarks("sample")
    found = list(assignments(lines, remarks))
    assert len(found) == text.count("]=") == sum(isinstance(line, ArrayAssignment) for line in lines)
    assert not remarks.messages


def test_what_the_samples_lack_is_named(shared: Callable[[str], Path]) -> None:
    """Two leave values out, one has a value too many and (MAX - MIN) / STEP not whole in the manual itself."""
    folder = shared("tables") / "siemens"
    figure, manual = (
        {message.text for message in CONTROL.lint({"a.ini": (folder / f"{name}.ini").read_bytes()})}
        for name in ("cec_fig73_seed001", "cec_802Dsl_manual_example")
    )
    assert "table 3 has values 0 to 13 by its MIN, MAX and STEP; this one is ignored" in figure
    assert any("not a whole number: the control would move the end" in text for text in manual)
    eec = CONTROL.lint({"b.ini": (folder / "eec_manual_example.ini").read_bytes()})
    assert any("797 of 801 values of X1 are missing, first $AA_ENC_COMP[0,3,X1]" in each.text for each in eec)


@pytest.mark.parametrize("terms", TERMS)
def test_the_probe_of_products_reads_as_its_comment_says(shared: Callable[[str], Path], terms: str) -> None:
    """0.02 product only, 0.22 and the multiplier, 0.12 and the base, 0.32 both."""
    text = (shared("tables") / "siemens" / "cec_mult_probe_RECONSTRUCTED.ini").read_text()
    remarks = Remarks("")
    tables = read_cec(parsed(text), remarks)
    assert not remarks.messages
    reading = TableReading({"X": "AX1", "Z": "AX3"}, 1, terms)
    found = compensation(tables, reading).at(("X", "Z"), np.array([[-50.0, -20.0]]))
    assert found[0].tolist() == pytest.approx([PROBE_READINGS[terms], 0.0])


# -- settings ----------------------------------------------------------------------------------------------------------


def test_the_sign_must_be_given() -> None:
    with pytest.raises(UsageError, match="value_sign"):
        CONTROL.settings({})


def test_products_need_to_know_what_they_add() -> None:
    with pytest.raises(UsageError, match="product_terms"):
        made(single_error("ECX", 20e-6), product_terms="")
    assert made(single_error("EXX"), product_terms="").left.after.max() < 1e-4


@pytest.mark.parametrize(
    "settings",
    [
        {"value_sign": "minus"},
        {"product_terms": "maybe"},
        {"scheme": "magic"},
        {"model": "810D"},
        {"tables": "0"},
        {"points": "x"},
        {"rotary": "yes"},
        {"positioning": "lec"},
        {"axes": "X:AX1"},
        {"axes": "X:AX1,Y:AX1,Z:AX3"},
        {"axes": "X:A X,Y:AX2,Z:AX3"},
        {"brackets": "true"},
    ],
)
def test_wrong_settings(settings: dict[str, str]) -> None:
    with pytest.raises(UsageError) as caught:
        made(single_error("EXX"), **settings)
    assert caught.value.code == "NCF485"


def test_letters_that_do_not_tell_degrees_from_millimetres() -> None:
    machine = single_error("EXX")
    axes = (replace(machine.axes[0], name="A"), *machine.axes[1:])
    other = machine.replace(axes=axes, effects=(), topology="w F A Y Z t")
    with pytest.raises(RefusedError, match="rotary axes A B C") as caught:
        made(other)
    assert caught.value.code == "NCF484"


def test_a_scheme_that_takes_more_tables_than_there_are() -> None:
    with pytest.raises(RefusedError, match="9 tables, but the control has 8") as caught:
        made(single_error("EXX"), scheme="poly25", model="828D")
    assert caught.value.code == "NCF484"


def test_polynomials_for_any_machine() -> None:
    machine = single_error("EXX").replace(effects=(Effect("EYX", (1e-4,), Polynomial((1,))),))
    assert made(machine, scheme="poly25").left.after.max() < 1e-4


def test_what_takes_a_factor_off_again_beside_encoder_tables_is_not_corrected_twice() -> None:
    machine = single_error("EBX", 20e-6).replace(
        effects=(
            Effect("EBX", (20e-6,), Polynomial((1,)), scale=300.0),
            Effect("EXX", (0.01,), Polynomial((2,)), scale=300.0),
        )
    )
    assert not made(machine, product_terms="plus_both", positioning="eec").messages


@pytest.mark.parametrize("terms", ["plus_both", "plus_multiplier", "plus_base"] if FULL else ["plus_both"])
def test_tables_that_take_off_again_fit_too(root: Path, terms: str) -> None:
    """What the control adds besides products takes tables: there are as many products as leave room for these."""
    machine = load(str(root / "examples" / "machines" / "wCBXFZYSt.toml"))
    control = get_control("siemens")
    settings = control.settings({"value_sign": "error", "product_terms": terms})
    made = export(control, Request(machine, ranges_of(machine), 120.0, 0.005, settings), 500)
    assert made.native["NC_CEC.INI"].count(b"$AN_CEC_INPUT_AXIS") <= 40
    assert b"$AN_CEC_MULT_BY_TABLE" in made.native["NC_CEC.INI"]
    figures = made.left.figures()
    assert figures["after"]["rms"] < 0.5 * figures["before"]["rms"]
