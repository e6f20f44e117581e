"""Random programs with canned cycles on five-axis machines: all languages and cycles, in all frames these have."""

from __future__ import annotations

import random
from collections.abc import Callable

ROTARY = "AC"
"""The rotary axes of the machine."""

G_CYCLES = {
    73: "Q2",
    74: "",
    76: "Q0.2",
    81: "",
    82: "P1",
    83: "Q2",
    84: "",
    85: "",
    86: "P1",
    87: "Q0.2",
    88: "P1",
    89: "P1",
}
LINUXCNC = (73, 81, 82, 83, 85, 86, 88, 89)
"""Those that its interpreter has without further words."""

PECK = "Q200=+2 ~\nQ201=-8 ~\nQ206=+150 ~\nQ202=+5 ~\nQ210=+0 ~\nQ203=+0 ~\nQ204=+50 ~\nQ211=+0"
KLARTEXT_CYCLES = (
    f"CYCL DEF 200 DRILLING ~\n{PECK}",
    "CYCL DEF 201 REAMING ~\nQ200=+2 ~\nQ201=-6 ~\nQ206=+100 ~\nQ211=+0.5 ~\nQ208=+250 ~\nQ203=+0 ~\nQ204=+50",
    "CYCL DEF 207 RIGID TAPPING ~\nQ200=+2 ~\nQ201=-9 ~\nQ239=+1 ~\nQ203=+0 ~\nQ204=+50",
    "CYCL DEF 240 CENTERING ~\nQ200=+2 ~\nQ343=+0 ~\nQ201=-2 ~\nQ344=-10 ~\nQ206=+250 ~\nQ211=+0 ~\nQ203=+0 ~\n"
    "Q204=+50",
    "CYCL DEF 1.0 PECKING\nCYCL DEF 1.1 SET UP 2\nCYCL DEF 1.2 DEPTH -8\nCYCL DEF 1.3 PECKG 5\nCYCL DEF 1.4 DWELL 0\n"
    "CYCL DEF 1.5 F200",
    "CYCL DEF 2.0 TAPPING\nCYCL DEF 2.1 SET UP 2\nCYCL DEF 2.2 DEPTH -8\nCYCL DEF 2.3 DWELL 0.5\nCYCL DEF 2.4 F100",
)


def number(dice: random.Random, low: float = -30.0, high: float = 30.0) -> str:
    """A number with a point."""
    return f"{dice.uniform(low, high):.{dice.randint(1, 3)}f}"


def g_code(dialect: str, dice: random.Random) -> str:
    """A program of LinuxCNC, ISO or Fanuc."""
    strict = dialect == "linuxcnc"

    def turn() -> str:
        return f"A{number(dice, -40, 40)} C{number(dice, -60, 60)}"

    frames: list[list[str]] = [[], [f"G52 X{number(dice, -5, 5)} Y3."] if not strict else ["G92.1"]]
    if not strict:
        frames.append([f"G68 X1. Y2. R{number(dice, -60, 60)}"])
    if dialect == "fanuc":
        tilt = f"G68.2 X2. Y3. Z1. I{number(dice, -20, 20)} J{number(dice, 5, 25)} K{number(dice, -20, 20)}"
        frames += [[tilt, "G53.1"], [tilt, "G53.1"], ["G49", f"G43.4 H1 X0. Y0. Z60. {turn()}"]]
    frame = dice.choice(frames)
    held = any("G68.2" in line for line in frame)
    lines = ["%", *(["O1"] if dialect == "fanuc" else []), "G17 G21 G40 G49 G80 G90 G94", "T1 M6", "G54", "G43 H1"]
    lines += [f"G0 X0. Y0. Z60. {turn()}", "F500.", *frame, f"G0 X{number(dice)} Y{number(dice)} Z50."]
    for _ in range(dice.randint(1, 3)):
        code = dice.choice(LINUXCNC if strict else tuple(G_CYCLES))
        more = G_CYCLES[code] if code in (73, 83) or not strict else ("P1" if code in (82, 86, 88, 89) else "")
        back = dice.choice(("G98 ", "G99 "))
        turned = "" if strict or held or dice.random() < 0.6 else f" {turn()}"
        deep = number(dice, -9, -3)
        lines.append(f"{back}G{code} X{number(dice)} Y{number(dice)} Z{deep} R{number(dice, 1, 5)} {more}{turned}")
        for _ in range(dice.randint(0, 3)):
            letters = dice.choice(("X", "Y", "XY"))
            words = [f"{letter}{number(dice)}" for letter in letters]
            words += [f"Z{number(dice, -9, -3)}"] * (dice.random() < 0.3)
            words += [f"C{number(dice, -60, 60)}"] * (not strict and not held and dice.random() < 0.3)
            lines.append(" ".join(words))
        lines.append("G80")
        lines.append(f"G0 Z50. {'' if held or dice.random() < 0.5 else turn()}")
    ends = ["G69"] if "G68" in " ".join(frame) else []
    return "\n".join([*lines, *ends, "G0 Z60.", "M2" if strict else "M30", "%"]) + "\n"


def klartext(_: str, dice: random.Random) -> str:
    """A program of Heidenhain."""

    def signed(low: float = -30.0, high: float = 30.0) -> str:
        text = number(dice, low, high)
        return text if text.startswith("-") else "+" + text

    def turn() -> str:
        return f"A{signed(-40, 40)} C{signed(-60, 60)}"

    frame = dice.choice(
        (
            [],
            ["M128"],
            [f"PLANE SPATIAL SPA{signed(5, 20)} SPB{signed(-20, 20)} SPC+0 TURN FMAX SEQ-"],
            ["CYCL DEF 10.0 ROTATION", f"CYCL DEF 10.1 ROT{signed(-60, 60)}"],
        )
    )
    held = any("PLANE" in line for line in frame)
    lines = ["BEGIN PGM T MM", "TOOL CALL 1 Z S1000", f"L X+0 Y+0 Z+60 {turn()} R0 FMAX", *frame]
    lines.append(f"L X{signed()} Y{signed()} Z+50 R0 FMAX")
    for _ in range(dice.randint(1, 3)):
        lines.append(dice.choice(KLARTEXT_CYCLES))
        for _ in range(dice.randint(1, 4)):
            words = " ".join(f"{letter}{signed()}" for letter in dice.choice(("X", "Y", "XY")))
            turned = "" if held or dice.random() < 0.6 else f" {turn()}"
            lines += dice.choice(
                (
                    [f"L {words}{turned} R0 FMAX M99"],
                    [f"L {words}{turned} R0 FMAX", "CYCL CALL"],
                    [f"L {words} R0 FMAX", "L Z+40 R0 FMAX", "CYCL CALL M3"],
                    [f"CYCL CALL POS {words} Z+0 FMAX"],
                )
            )
    return "\n".join([*lines, "L Z+60 R0 FMAX", "END PGM T MM"]) + "\n"


LANGUAGES: dict[str, Callable[[str, random.Random], str]] = {
    "linuxcnc": g_code,
    "iso": g_code,
    "fanuc": g_code,
    "haas": g_code,
    "heidenhain": klartext,
}
