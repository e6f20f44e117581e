"""The same setup for both: as the control's own files (`canon.Controls`) and as the product's setup file."""

from __future__ import annotations

from pathlib import Path

from differential.canon import Controls

AXES = "XYZABC"


def text(controls: Controls, axes: str, start: bool = True) -> str:
    """A setup file (TOML). Work offsets that are not given are zero, as in the control's parameter file."""
    names = ("G54", "G55", "G56", "G57", "G58", "G59")
    padded = {name: [*controls.offsets.get(name, ()), *[0.0] * 6][:6] for name in names}
    lines = [f"work_offsets.{name} = {values}" for name, values in padded.items()] if start else []
    lines += ["tools.0 = { length = 0.0 }"] if start else []
    lines += [f"tools.{n} = {{ length = {length!r}, radius = {diameter / 2!r} }}"
              for n, (length, diameter) in controls.tools.items()]  # fmt: skip
    lines += [f"references.{name} = {_by_axis(values, axes)}" for name, values in controls.references.items()]
    lines += [f'variables."#{number}" = {value!r}' for number, value in controls.variables.items()]
    lines += [f"initial = {_by_axis(controls.initial, axes)}"] if start else []
    lines += ["block_skip = true"] if controls.block_skip else []
    return "\n".join(lines) + "\n"


def write(folder: Path, controls: Controls, axes: str, start: bool = True) -> Path:
    """A setup file on disk."""
    path = folder / "setup.toml"
    path.write_text(text(controls, axes, start))
    return path


def _by_axis(values: tuple[float, ...], axes: str) -> str:
    padded = [*values, *[0.0] * (6 - len(values))]
    given = ", ".join(f"{axis} = {value!r}" for axis, value in zip(AXES, padded, strict=True) if axis in axes)
    return f"{{ {given} }}"
