"""`import ncfix`: the page that shows it runs, nothing heavy is imported early, no file is touched unasked."""

from __future__ import annotations

import inspect
import math
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import ncfix
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import RefusedError, SourceError, UsageError
from ncfix.measure.candidates import Room
from ncfix.measure.instruments import Faults
from ncfix.measure.measurement import Measurement
from ncfix.text import reader
from ncfix.text.tree import Program

SETUP = Setup(assume_zero=True, no_point="calculator")


@pytest.fixture
def shop(tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(root / "examples/machines/three_axis.toml", tmp_path / "machine.toml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_runs(shop: Path, root: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (root / "docs/api.md").read_text(), re.DOTALL)
    assert len(blocks) >= 8
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/api.md", "exec"), names)
    written = {path.name for path in shop.iterdir()}
    assert written == {"machine.toml", "part.fixed.nc", "tables", "machine.html"}


def test_the_page_names_every_function(root: Path) -> None:
    page = (root / "docs/api.md").read_text()
    assert len(ncfix.FUNCTIONS) == 11
    for name in ncfix.FUNCTIONS:
        assert f"| `{name}(" in page
        assert inspect.getdoc(getattr(ncfix, name))


def test_nothing_heavy_is_imported() -> None:
    code = (
        "import sys, ncfix; print(sorted(m for m in ('numpy', 'scipy', 'lark', 'click', 'pluggy') if m in sys.modules))"
    )
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.strip() == "[]"


def test_an_attribute_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fixx'"):
        ncfix.fixx  # noqa: B018


def test_what_is_refused_is_not_written(shop: Path) -> None:
    text = "G21 G90 G54\nG0 X0. Y0. Z5.\nG33 Z-5. K1.\nM30\n"
    program = ncfix.read_program(text=text, dialect="iso")
    fixed = ncfix.fix(program, "machine.toml", setup=SETUP)
    assert [each.line for each in fixed.report.refused] == [3]
    with pytest.raises(RefusedError):
        ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc")
    assert not (shop / "out.nc").exists()
    ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc", allow_refused=True)
    with pytest.raises(UsageError, match="NCF004"):
        ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc", allow_refused=True)


def test_subprograms_beside_a_program_and_of_a_text(shop: Path) -> None:
    main = "O1\nG21 G90 G54\nG0 X0. Y0. Z5.\nM98 P100\nM30\n"
    Path("100.nc").write_text("O100\nG1 X5. F100.\nM99\n")
    Path("main.nc").write_text(main)
    assert ncfix.simulate("main.nc", "machine.toml", setup=SETUP).line is not None
    with pytest.raises(Exception, match="100"):
        ncfix.simulate(ncfix.read_program(text=main), "machine.toml", setup=SETUP)
    found = ncfix.simulate(ncfix.read_program(Path("main.nc")), Path("machine.toml"), setup=SETUP)
    assert found.max_um is not None


def test_a_path_or_a_text_and_not_both() -> None:
    for given in ({}, {"source": "part.nc", "text": "M30\n"}):
        for function in (ncfix.read_program, ncfix.load_machine):
            with pytest.raises(TypeError, match="give a path or a text, not both"):
                function(**given)


def test_a_machine_that_cannot_be_makes_nothing_unless_forced(shop: Path) -> None:
    effect = '\n[[effect]]\nname = "EYX"\nbasis = "constant"\ncoefficients = [80.0]\n'
    text = (shop / "machine.toml").read_text() + effect
    (shop / "odd.toml").write_text(text)
    program = ncfix.read_program(text="G21 G90 G94\nG0 X1 Y1 Z1\nG1 X5 F100\nM2\n", dialect="linuxcnc")
    for make in (
        lambda force: ncfix.fix(program, "odd.toml", setup=SETUP, force=force),
        lambda force: ncfix.export("linuxcnc", "odd.toml", output="out", force=force),
    ):
        with pytest.raises(RefusedError, match="NCF324") as caught:
            make(False)
        assert {each.place.path for each in caught.value.messages if each.place} == {"odd.toml"}
    assert not (shop / "out").exists()


def test_tables_are_written_all_or_none(shop: Path) -> None:
    made = ncfix.export("isg", "machine.toml", tool_length=120.0)
    last = sorted(made.files)[-1]
    (shop / "out").mkdir()
    (shop / "out" / last).write_text("mine")
    with pytest.raises(UsageError, match="NCF004"):
        ncfix.export("isg", "machine.toml", tool_length=120.0, output="out")
    assert [path.name for path in (shop / "out").iterdir()] == [last]
    assert (shop / "out" / last).read_text() == "mine"


# -- what the command line refuses the functions refuse ----------------------------------------------------------------

MOVES = "G21 G90 G94\nG0 X1 Y1 Z1\nG1 X5 F100\nM2\n"
NO_NUMBER = (math.nan, math.inf, -1.0)


def code_of(make: Callable[[], object]) -> str:
    with pytest.raises(UsageError) as caught:
        make()
    return caught.value.code


@pytest.fixture
def program(shop: Path) -> Program:
    return ncfix.read_program(text=MOVES, dialect="linuxcnc")


@pytest.fixture
def measured(shop: Path) -> Measurement:
    planned = ncfix.plan("machine.toml", count=8, effects="EXX")
    return ncfix.simulate(planned.plan, "machine.toml", faults=Faults(noise_um=1.0))


@pytest.mark.parametrize("number", [*NO_NUMBER, 0.001])
def test_a_tolerance_that_is_none(program: Program, number: float) -> None:
    assert code_of(lambda: ncfix.fix(program, "machine.toml", setup=SETUP, tolerance_um=number)) == "NCF025"
    assert code_of(lambda: ncfix.verify(program, program, "machine.toml", setup=SETUP, tolerance_um=number)) == "NCF025"


@pytest.mark.parametrize("number", NO_NUMBER)
def test_numbers_of_tables_and_measurements_that_are_none(shop: Path, number: float) -> None:
    for name in ("target_um", "tool_length"):
        assert code_of(lambda name=name: ncfix.export("linuxcnc", "machine.toml", **{name: number})) == "NCF025"
    for name in ("noise_um", "noise_urad", "drift_um", "quantum_um", "setup"):
        assert code_of(lambda name=name: Faults(**{name: number})) == "NCF025"
    assert code_of(lambda: ncfix.plan("machine.toml", room=Room(tool_lengths=(number,)))) == "NCF025"
    assert code_of(lambda: ncfix.plan("machine.toml", count=number)) == "NCF636"
    assert code_of(lambda: ncfix.plan("machine.toml", seed=number)) == "NCF025"


@pytest.mark.parametrize("said", [{"loss": "foo"}, {"prune": 0.5}, {"prune": math.nan}, {"knots": -1}, {"knots": 1.5}])
def test_choices_of_calibration_that_there_are_not(measured: Measurement, said: dict[str, Any]) -> None:
    assert code_of(lambda: ncfix.calibrate(measured, "machine.toml", **said)) == "NCF025"


def test_other_choices_that_there_are_not(program: Program, measured: Measurement) -> None:
    assert code_of(lambda: ncfix.fix(program, "machine.toml", setup=SETUP, block_numbers="some")) == "NCF025"
    assert code_of(lambda: ncfix.simulate(measured, "machine.toml", seed=-1)) == "NCF025"
    assert code_of(lambda: ncfix.simulate(measured, "machine.toml", setup=SETUP)) == "NCF025"
    assert code_of(lambda: ncfix.simulate(program, "machine.toml", setup=SETUP, faults=Faults())) == "NCF025"


def test_no_output_takes_the_place_of_an_input(shop: Path, measured: Measurement) -> None:
    from ncfix.measure.measurement import dumps

    Path("part.ngc").write_text(MOVES)
    Path("data.csv").write_text(dumps(measured))
    Path("link.csv").hardlink_to("data.csv")
    before = {path: path.read_bytes() for path in shop.iterdir()}
    read = ncfix.read_program("part.ngc")
    for make in (
        lambda output: ncfix.fix("part.ngc", "machine.toml", setup=SETUP, output=output, force=True),
        lambda output: ncfix.plan("machine.toml", existing="data.csv", output=output, force=True),
        lambda output: ncfix.calibrate(["data.csv"], "machine.toml", output=output, force=True),
        lambda output: ncfix.diagnose("link.csv", "machine.toml", output=output, force=True),
        lambda output: ncfix.report("machine.toml", output=output, force=True),
    ):
        assert code_of(lambda make=make: make("./machine.toml")) == "NCF005"
        assert code_of(lambda make=make: make("")) == "NCF003"
    assert code_of(lambda: ncfix.fix(read, "machine.toml", output="part.ngc", force=True)) == "NCF005"
    assert code_of(lambda: ncfix.calibrate("data.csv", "machine.toml", output="link.csv", force=True)) == "NCF005"
    assert code_of(lambda: ncfix.plan("machine.toml", existing="data.csv", output="link.csv", force=True)) == "NCF005"
    assert {path: path.read_bytes() for path in shop.iterdir()} == before


def test_outputs_are_looked_at_before_anything_is_computed(shop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("nothing is to be computed")

    monkeypatch.setattr("ncfix.measure.plan.plan", never)
    monkeypatch.setattr("ncfix.tables.export.export", never)
    Path("there.csv").write_text("mine")
    assert code_of(lambda: ncfix.plan("machine.toml", output="there.csv")) == "NCF004"
    assert code_of(lambda: ncfix.plan("machine.toml", output="there.csv/below")) == "NCF007"
    for folder, code in (("", "NCF003"), ("there.csv", "NCF007")):
        assert code_of(lambda folder=folder: ncfix.export("linuxcnc", "machine.toml", output=folder)) == code


def test_tables_do_not_take_the_place_of_the_machine(shop: Path) -> None:
    names = sorted(ncfix.export("linuxcnc", "machine.toml").files)
    (shop / "out").mkdir()
    machine = shop / "out" / names[-1]
    machine.write_bytes(Path("machine.toml").read_bytes())
    assert code_of(lambda: ncfix.export("linuxcnc", machine, output="out", force=True)) == "NCF005"
    assert [path.name for path in (shop / "out").iterdir()] == [machine.name]


def test_a_fixed_file_is_read_in_the_dialect_of_the_original(shop: Path) -> None:
    original = ncfix.read_program(text="G21 G90 G94\nG0 X1 Y1 Z1\nG1 X5 F100\nM30\n", dialect="fanuc")
    Path("fixed.ngc").write_bytes(ncfix.fix(original, "machine.toml", setup=SETUP).text)
    read = []
    whole = reader.read

    def seen(source: bytes, path: str, dialect: Any) -> Program:
        read.append(getattr(dialect, "name", dialect))
        return whole(source, path, dialect)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader, "read", seen)
        assert ncfix.verify(original, "fixed.ngc", "machine.toml", setup=SETUP).within
    assert read == ["fanuc"]


def test_measurements_count_once(measured: Measurement) -> None:
    from ncfix.measure.measurement import dumps

    Path("data.csv").write_text(dumps(measured))
    for function in (ncfix.calibrate, ncfix.diagnose):
        for twice in ([measured, measured], ["data.csv", "./data.csv"]):
            assert code_of(lambda twice=twice: function(twice, "machine.toml")) == "NCF020"  # noqa: B023
        assert code_of(lambda: function([], "machine.toml")) == "NCF025"  # noqa: B023


@pytest.mark.parametrize(
    ("room", "said"),
    [
        (Room(ranges={"B": (0.0, 1.0)}), "the machine has no axis B, only"),
        (Room(ranges={"X": (0.0, 1e6)}), "the travel of X is only"),
        (Room(ranges={"X": (5.0, 1.0)}), "is an empty range"),
        (Room(ranges={"X": (math.nan, 1.0)}), "is an empty range"),
        (Room(reach={"u": (0.0, 1.0)}), "u is none of x, y and z of the workpiece"),
        (Room(reach={"x": (1.0, 1.0)}), "is an empty range"),
        (Room(inputs={"load_kg": (0.0, math.inf)}), "is an empty range"),
        (Room(balls={"one": (0.0, math.nan, 0.0)}), "the position of the ball one is not finite"),
        (Room(tool_lengths=()), "no tool length is given"),
        (Room(ranges={"X": (1.0,)}), "the range of X is not two numbers"),  # type: ignore[dict-item]
        (Room(reach={"x": (1.0, 2.0, 3.0)}), "the range of x is not"),  # type: ignore[dict-item]
        (Room(inputs={"load_kg": ()}), "the range of load_kg is not"),  # type: ignore[dict-item]
        (Room(balls={"one": (0.0, 1.0)}), "the ball one is not three numbers"),  # type: ignore[dict-item]
    ],
)
def test_a_room_that_the_machine_does_not_have(shop: Path, room: Room, said: str) -> None:
    with pytest.raises(UsageError, match="NCF636") as caught:
        ncfix.plan("machine.toml", room=room)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "given",
    [
        {"work_offsets": {"G54": {"X": math.nan}}},
        {"work_offsets": {"G54": {"Q": 1.0}}},
        {"initial": {"Z": math.inf}},
        {"initial": {"x": 1.0}},
        {"references": {"G30": {"Z": -math.inf}}},
        {"probed": {"Z": math.nan}},
        {"tools": {1: Tool(length=math.nan)}},
        {"named_tools": {"DRILL": Tool(length=1.0, radius=math.inf)}},
        {"variables": {"#100": "1"}},
        {"inputs": {"temp_spindle": math.nan}},
        {"workpiece_offset": (0.0, math.nan, 0.0)},
    ],
)
def test_a_setup_has_finite_numbers_for_axes_that_there_are(
    program: Program, shop: Path, given: dict[str, Any]
) -> None:
    setup = Setup(**given)
    for call in (
        lambda: ncfix.fix(program, "machine.toml", setup=setup),
        lambda: ncfix.verify(program, program, "machine.toml", setup=setup),
        lambda: ncfix.simulate(program, "machine.toml", setup=setup),
    ):
        assert code_of(call) == "NCF025"


def test_a_range_of_tables_is_two_numbers(shop: Path) -> None:
    for limits in ((1.0,), (1.0, 2.0, 3.0)):
        bad: dict[str, Any] = {"X": limits}
        assert code_of(lambda bad=bad: ncfix.export("linuxcnc", "machine.toml", ranges=bad)) == "NCF483"


def test_names_of_effects_are_a_list_and_those_that_do_not_exist_are_said(measured: Measurement) -> None:
    assert code_of(lambda: ncfix.diagnose(measured, "machine.toml", without="EXX")) == "NCF025"
    assert code_of(lambda: ncfix.plan("machine.toml", separate="EXX")) == "NCF025"
    one_text: Any = ["EXX"]
    assert code_of(lambda: ncfix.plan("machine.toml", effects=one_text)) == "NCF025"
    assert code_of(lambda: ncfix.calibrate(measured, "machine.toml", effects=one_text)) == "NCF025"
    assert code_of(lambda: ncfix.plan("machine.toml", existing=[measured, measured.with_columns({})])) == "NCF025"
    found = ncfix.diagnose(measured, "machine.toml", without=["no such name"])
    assert "NCF657" in [message.code for message in found.messages]


def test_what_is_not_there_has_a_code(shop: Path) -> None:
    with pytest.raises(SourceError, match="nowhere: NCF002"):
        ncfix.emulate("linuxcnc", "nowhere", "machine.toml")
    with pytest.raises(SourceError, match="<program>:2:2: NCF101"):
        ncfix.read_program(text="G0\n(\u2013)\n")
    assert code_of(ncfix.report) == "NCF025"


def test_what_was_assumed_is_said(program: Program) -> None:
    assumed = ncfix.simulate(program, "machine.toml", setup=SETUP).messages
    assert assumed
    assert ncfix.verify(program, program, "machine.toml", setup=SETUP).messages == assumed
    fixed = ncfix.read_program(text=ncfix.fix(program, "machine.toml", setup=SETUP).text, dialect="linuxcnc")
    assert ncfix.simulate(fixed, "machine.toml", setup=SETUP).messages[0].code == "NCF430"


def test_what_is_no_value_of_the_type_is_named(shop: Path, program: Program) -> None:
    text = "G21 G90 G54\nG0 X0.\nM30\n"
    calls: list[Callable[[], object]] = [
        lambda: ncfix.fix(text, "machine.toml", setup=SETUP),
        lambda: ncfix.fix(text.encode(), "machine.toml", setup=SETUP),  # type: ignore[call-overload, arg-type]
        lambda: ncfix.load_machine(Path("machine.toml").read_text()),
        lambda: ncfix.fix(program, None, setup=SETUP),  # type: ignore[arg-type]
        lambda: ncfix.fix(program, "machine.toml", setup={"work_offsets": {}}),  # type: ignore[arg-type]
        lambda: ncfix.verify(program, ncfix.fix(program, "machine.toml", setup=SETUP), "machine.toml", setup=SETUP),  # type: ignore[arg-type]
        lambda: ncfix.report(5),  # type: ignore[arg-type]
    ]
    for call in calls:
        with pytest.raises(TypeError, match="is needed"):
            call()
    with pytest.raises(UsageError, match=r"Tool\(length=120.0\)"):
        ncfix.fix(program, "machine.toml", setup=Setup(tools={1: 120.0}, assume_zero=True))  # type: ignore[dict-item]


def test_results_are_compared_and_pickled(shop: Path, program: Program, measured: Measurement) -> None:
    machine = ncfix.load_machine("machine.toml")
    results: list[Any] = [
        machine,
        program,
        measured,
        ncfix.fix(program, machine, setup=SETUP),
        ncfix.simulate(program, machine, setup=SETUP),
        ncfix.verify(program, program.source, machine, setup=SETUP),
        ncfix.plan(machine, count=6, effects="EXX,EYY"),
        ncfix.export("linuxcnc", machine, tool_length=100.0),
        ncfix.calibrate(measured, machine, effects="EXX"),
    ]
    for result in results:
        again = pickle.loads(pickle.dumps(result))
        assert type(again) is type(result)
        assert (again == result) in (True, False)
        assert result == result


def test_threads_do_not_disturb_each_other(shop: Path) -> None:
    machine = ncfix.load_machine("machine.toml")
    lines = "".join(f"X{k % 97}.{k % 10} Y{k % 53}.5\n" for k in range(800))
    texts = [f"G21 G90 G54\nG0 X0. Y0. Z{k}.\nG1 Z-1. F{k + 100}\n{lines}M30\n" for k in range(4)]

    def fixed(text: str) -> bytes:
        return ncfix.fix(ncfix.read_program(text=text), machine, setup=SETUP).text

    alone = [fixed(text) for text in texts]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(fixed, texts * 2)) == alone * 2
