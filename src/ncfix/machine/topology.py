"""The topology string: "w C B F X Y Z S t", joints from the workpiece through the foundation F to the tool."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Topology:
    """The axes on both branches, in the order of the string."""

    workpiece: tuple[str, ...]
    tool: tuple[str, ...]
    spindle: bool = False

    @property
    def axes(self) -> tuple[str, ...]:
        """All axes, from the workpiece to the tool."""
        return self.workpiece + self.tool

    def __str__(self) -> str:
        spindle = ("S",) if self.spindle else ()
        return " ".join(("w", *self.workpiece, "F", *self.tool, *spindle, "t"))


def parse(text: str) -> tuple[Topology | None, list[str]]:
    """The topology, or what is wrong with the string. Blanks between the letters may be left out."""
    letters = text.split() if " " in text.strip() else list(text.strip())
    wrong = list(_faults(letters))
    if wrong:
        return None, wrong
    foundation = letters.index("F")
    workpiece, tool = tuple(letters[1:foundation]), tuple(letters[foundation + 1 : -1])
    spindle = tool[-1:] == ("S",)
    return Topology(workpiece, tool[:-1] if spindle else tool, spindle), []


def _faults(letters: list[str]) -> list[str]:
    wrong = []
    if letters[:1] != ["w"]:
        wrong.append("it must start with w, the workpiece")
    if letters[-1:] != ["t"]:
        wrong.append("it must end with t, the tool")
    if letters.count("F") != 1:
        wrong.append(f"the foundation F must be named once, not {letters.count('F')} times")
    joints = letters[1:-1]
    if "S" in joints[:-1]:
        wrong.append("the spindle S can only stand last, before t")
    strange = [each for each in joints if not (len(each) == 1 and "A" <= each <= "Z")]
    wrong += [f"{each!r} is not an axis letter" for each in strange]
    twice = sorted({each for each in joints if joints.count(each) > 1 and each != "F"})
    return wrong + [f"axis {each} is named twice" for each in twice]
