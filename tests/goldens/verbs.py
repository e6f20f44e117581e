"""The cases of the other verbs: machines, measurements, tables and pages, on the examples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from goldens.case import ROOT, Case, Step

CONTROLS = {
    "fanuc": ("sign=error",),
    "fanuc-pitch": ("sign=error",),
    "fanuc-rotary": ("sign=error",),
    "gcode": (),
    "heidenhain": ("sign=error",),
    "heidenhain-kinematics": ("sign=error", "angle_unit=deg"),
    "isg": (),
    "linuxcnc": (),
    "siemens": ("value_sign=error", "product_terms=only"),
}
"""Controls with tables, and the settings without which `export` asks."""
KINDS = ("tcp", "tcp6", "probe", "length")
RANGES = {"probe": ("--ball", "a=50,0,100", "--ball", "b=-60,40,80"), "length": (), "tcp": (), "tcp6": ()}
PAGES = ("page.md", "page.html")


def cases() -> Iterator[Case]:
    """All of them."""
    yield from faces()
    yield from machines()
    yield from formulas()
    yield from measurements()
    yield from tables()
    yield from pages()


def machine_files() -> Iterator[tuple[str, str]]:
    """Names and paths of machine files, as cases see them."""
    for path in sorted((ROOT / "examples").glob("machines/*.toml")):
        yield path.stem, f"../examples/machines/{path.name}"
    for path in sorted((ROOT / "examples").glob("stories/*/*.toml")):
        if "setup" not in path.name:
            yield f"{path.parent.name}-{path.stem}", f"../examples/stories/{path.parent.name}/{path.name}"
    yield "tilted_ac", "../examples/siemens/tilted_ac.toml"
    for name in ("three", "table", "head", "play"):
        yield name, f"../machines/{name}.toml"


def faces() -> Iterator[Case]:
    """What is the same on every machine: lists, explanations, help."""
    yield of("machine", "dialects", ["dialects"], ["dialects", "--json"])
    yield of("machine", "effects", ["effects"], ["effects", "--json"])
    for hundred in range(10):
        codes = [f"NCF{100 * hundred + one:03}" for one in range(100)]
        yield of("machine", f"explain-{hundred}", *(["explain", code] for code in codes))
    verbs = "fix check trace verify simulate plan calibrate diagnose export emulate lint report derive machine effects"
    yield of("machine", "help", ["--help"], *([verb, "--help"] for verb in verbs.split()))


def machines() -> Iterator[Case]:
    """Machine files looked at, and what such machines do to a cube of poses."""
    for name, path in machine_files():
        looked = [["machine", verb, path, *more] for verb in ("check", "show") for more in ([], ["--json"])]
        yield of("machine", f"machine-{name}", *looked, ["effects", "-m", path], ["effects", "-m", path, "--json"])


def formulas() -> Iterator[Case]:
    """Formulas of machines."""
    table, head = "../examples/machines/wCAYFXZSt.toml", "../examples/machines/angle_head.toml"
    chain = "../examples/chains/angle_head.toml"
    yield of("machine", "derive-locations", ["derive", "-m", table, "--effects", "locations"])
    yield of("machine", "derive-motions", ["derive", "-m", table, "--effects", "E?C,EB0C", "--order", "2", "--json"])
    yield of("machine", "derive-latex", ["derive", "-m", head, "--effects", "locations", "--latex"])
    yield of("machine", "derive-python", ["derive", "-m", head, "--effects", "E?X", "--python"])
    yield of("machine", "derive-protocol", ["derive", "--chain", chain, "--protocol", "--vary", "G"])


def measurements() -> Iterator[Case]:
    """Plans, measurements made up of them, calibrations and diagnoses."""
    for number, name in enumerate(("three_axis", "wCAYFXZSt", "wCBXFZYSt", "dmu50")):
        for kind in (KINDS[number], KINDS[(number + 2) % 4]):
            yield planned(name, kind, "30")
    for name, path in (("table", "../machines/table.toml"), ("play", "../machines/play.toml")):
        more = ["--range", "X=-300,300", "--range", "Y=-300,300", "--range", "Z=-100,300"]
        yield calibrated(f"made-{name}", path, "tcp", "60", "E?0?", more)
    for name, effects in (("wCAYFXZSt", "E?0?"), ("dmu50", "E?0?"), ("wCBXFZYSt", "")):
        yield calibrated(f"made-{name}", f"../examples/machines/{name}.toml", "tcp", "60", effects, [])
    yield calibrated("made-three_axis", "../examples/machines/three_axis.toml", "length", "60", "E?X,E?0?", [])
    story = "../examples/stories"
    for name, effects in (("EXX,EYY,EZZ", "gains"), ("EXX,EYY,EZZ,backlash-X,backlash-Y,backlash-Z", "play")):
        yield fitted(f"size_conflict-{effects}", f"{story}/size_conflict", ["measured.csv"], name)
    yield fitted("laspas-Z", f"{story}/laspas", ["measured-Z.csv"], "backlash-Z")
    yield fitted("laspas", f"{story}/laspas", [f"measured-{axis}.csv" for axis in "XYZ"], "")
    yield fitted("worn_table", f"{story}/worn_table", ["measured.csv"], "")
    yield fitted("worn_table-knots", f"{story}/worn_table", ["measured.csv"], "E?B,E?0?", "--prune", "0.99")
    yield fitted("worn_table-tukey", f"{story}/worn_table", ["measured.csv"], "E?0?", "--loss", "tukey")
    for name, files in (
        ("laspas", [f"measured-{axis}.csv" for axis in "XYZ"]),
        ("size_conflict", ["measured.csv"]),
        ("worn_table", ["measured.csv"]),
    ):
        measured = [f"{story}/{name}/{file}" for file in files]
        told = [*measured, "-m", f"{story}/{name}/machine.toml"]
        written = ["-o", "found.toml", "--report", "page.md", "--next", "next.csv"]
        yield Case(
            f"measure/diagnose-{name}",
            "measure",
            [Step("out", ["diagnose", *told, *written, "--json"])],
            outputs={"files": ["found.toml", "page.md", "next.csv"]},
        )


def planned(name: str, kind: str, count: str) -> Case:
    """A plan for a machine, and what would be measured."""
    path = f"../examples/machines/{name}.toml"
    plan = ["plan", "-m", path, "--kind", kind, "-n", count, "--tool-length", "120", *RANGES[kind], "-o", "plan.csv"]
    simulate = ["simulate", "-m", path, "--plan", "plan.csv", "--noise-um", "1", "--drift-um", "2", "--seed", "5"]
    return Case(
        f"measure/plan-{name}-{kind}",
        "measure",
        [
            Step("out", [*plan, "--gcode", "plan.nc", "--json"]),
            Step("out", [*simulate, "-o", "measured.csv", "--json"]),
        ],
        outputs={"files": ["plan.csv", "plan.nc", "measured.csv"]},
    )


def calibrated(name: str, path: str, kind: str, count: str, effects: str, more: Sequence[str]) -> Case:
    """A plan, a measurement made up, and the calibration of it."""
    plan = ["plan", "-m", path, "--kind", kind, "-n", count, *RANGES[kind], *more, "-o", "plan.csv"]
    simulate = ["simulate", "-m", path, "--plan", "plan.csv", "--noise-um", "1", "--setup-error", "0.02"]
    calibrate = ["calibrate", "measured.csv", "-m", path, *(["--effects", effects] if effects else [])]
    return Case(
        f"measure/{name}",
        "measure",
        [
            Step("out", [*plan, *(["--effects", effects] if effects else []), "--tool-length", "150"]),
            Step("out", [*simulate, "-o", "measured.csv"]),
            Step("out", [*calibrate, "-o", "calibrated.toml", "--json"]),
            Step("out", ["machine", "check", "calibrated.toml"]),
        ],
        outputs={"files": ["plan.csv", "measured.csv", "calibrated.toml"]},
    )


def fitted(name: str, folder: str, files: Sequence[str], effects: str, *more: str) -> Case:
    """The calibration of measurements of a story."""
    measured = [f"{folder}/{file}" for file in files]
    command = ["calibrate", *measured, "-m", f"{folder}/machine.toml", "--allow-misfit", *more]
    command += ["--effects", effects] if effects else []
    return Case(
        f"measure/calibrate-{name}",
        "measure",
        [Step("out", [*command, "-o", "calibrated.toml"]), Step("out", [*command, "-o", "again.toml", "--json"])],
        outputs={"files": ["calibrated.toml", "again.toml"]},
    )


def tables() -> Iterator[Case]:
    """Tables of all controls: written, run, and linted; of too many machines for all, every control has three."""
    shipped = ("three_axis", "wCAYFXZSt", "wCBXFZYSt", "dmu50")
    for number, (control, settings) in enumerate(CONTROLS.items()):
        for name in shipped:
            if name == shipped[1 + number % 3] or (control == "siemens" and name == "wCBXFZYSt"):
                continue
            told = ["-m", f"../examples/machines/{name}.toml"]
            chosen = [part for setting in settings for part in ("--set", setting)]
            export = ["export", control, *told, "--tool-length", "120", "--target-um", "2", "-o", "tables", *chosen]
            yield Case(
                f"tables/{control}-{name}",
                "tables",
                [
                    Step("out", [*export, "--json"]),
                    Step("out", ["emulate", control, "tables", *told]),
                    Step("out", ["emulate", control, "tables", *told, "--json"]),
                    Step("out", ["lint", "tables"]),
                ],
                outputs={"files": ["tables"]},
            )
    for control, settings in CONTROLS.items():
        if control == "siemens":
            continue
        chosen = [part for setting in settings for part in ("--set", setting)]
        command = ["export", control, "-m", "../machines/play.toml", "-o", "tables", *chosen, "--target-um", "50"]
        yield Case(f"tables/{control}-play", "tables", [Step("out", command)], outputs={"files": ["tables"]})
    command = ["export", "siemens", "-m", "../examples/machines/wCAYFXZSt.toml", "-o", "probe", "--probe"]
    yield Case("tables/siemens-probe", "tables", [Step("out", command)], outputs={"files": ["probe"]})


def pages() -> Iterator[Case]:
    """Machines and results on a page."""
    for name, path in machine_files():
        steps = [Step("out", ["report", path, "-o", page]) for page in PAGES]
        yield Case(f"report/{name}", "report", steps, outputs={"files": PAGES})
    story = "../examples/stories/worn_table"
    machine = ["-m", f"{story}/machine.toml"]
    program = [f"{story}/part.nc", *machine, "--setup", f"{story}/part.setup.toml"]
    simulate = ["simulate", *machine, "--program", f"{story}/part.nc", "--setup", f"{story}/part.setup.toml"]
    yield Case(
        "report/results",
        "report",
        [
            Step("out", ["fix", *program, "-o", "fixed.nc"]),
            Step("out", ["check", *program]),
            Step("out", ["verify", f"{story}/part.nc", "fixed.nc", *program[1:]]),
            Step("out", [*simulate, "-o", "path.csv"]),
            Step("out", simulate),
            Step("out", ["trace", *program]),
            Step("out", ["trace", *program, "-o", "motions.csv"]),
        ],
        outputs={"files": ["path.csv", "motions.csv", "fixed.nc"]},
    )


def of(group: str, name: str, *lines: Sequence[str]) -> Case:
    """A case that only prints."""
    return Case(f"{group}/{name}", group, [Step("out", line) for line in lines])
