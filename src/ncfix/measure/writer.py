"""Measurement files: `Measurement` to text that reads back as the same rows."""

from __future__ import annotations

from ncfix.measure.measurement import Measurement

DIGITS = 9
"""Decimals of mm, degree and rad: below any instrument."""


def dumps(measurement: Measurement, empty: tuple[str, ...] = ()) -> str:
    """The text of a measurement file; columns `empty` are written without values, to be filled in."""
    heads = {"ncfix-measurement": "1", "kind": measurement.kind}
    lines = [f"# {key}: {value}" for key, value in heads.items()]
    lines += [f"# {key}: {value}" for key, value in measurement.headers if key not in heads]
    texts = {name: list(values) for name, values in measurement.labels.items()}
    texts |= {name: [number(value) for value in values] for name, values in measurement.columns.items()}
    texts |= {name: [""] * len(measurement) for name in empty}
    lines.append(",".join(texts))
    lines += [",".join(row) for row in zip(*texts.values(), strict=True)]
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """A number as short as it is at nine decimals."""
    text = f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
