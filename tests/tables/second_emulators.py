"""What controls do with their tables, told a second time: read and interpolated here by nothing but numpy and words.

Nothing of ncfix is used. The facts are those of the manuals that docs/controllers.md names. Positions and corrections
are in mm and degree, one row a pose; a correction is what is added to the command.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Texts = Mapping[str, str]
ROTARY = "ABC"


def linuxcnc(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """Source control.c: trims between nominal positions, forward while the joint moves towards plus."""
    ini = files["comp.ini"]
    letters = re.search(r"COORDINATES = (.*)", ini)[1].split()  # type: ignore[index]
    inch = 25.4 if "LINEAR_UNITS = inch" in ini else 1.0
    found = np.zeros_like(q)
    for joint, path, kind in re.findall(r"\[JOINT_(\d+)\]\nCOMP_FILE = (\S+)\nCOMP_FILE_TYPE = (\d)", ini):
        letter = letters[int(joint)]
        unit = 1.0 if letter in ROTARY else inch
        rows = np.array([[float(word) for word in line.split()] for line in files[path].splitlines()])
        column = names.index(letter)
        trims = [rows[:, 0] - rows[:, k] if kind == "0" else rows[:, k] for k in (1, 2)]
        there, back = (np.interp(q[:, column] / unit, rows[:, 0], trim) * unit for trim in trims)
        found[:, column] = np.where(ways[:, column] > 0, there, back)
    return found


def siemens(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """Function Manual K3: point N at MIN + N STEP, ends held, modulo, directions, products of pairs, sums."""
    found = np.zeros_like(q)
    letters = {axis: letter for letter, axis in (pair.split(":") for pair in said["axes"].split(","))}
    for name, text in files.items():
        if "EEC" in name:
            found += _eec(text, letters, names, q)
            continue
        points: dict[int, dict[int, float]] = {}
        for table, place, value in re.findall(r"\$AN_CEC\[(\d+),(\d+)\]=(\S+)", text):
            points.setdefault(int(table), {})[int(place)] = float(value)
        words: dict[tuple[str, int], str] = {}
        for word, table, value in re.findall(r"\$AN_CEC_(\w+)\[(\d+)\]=\(?([^)\s]+)\)?", text):
            words[word, int(table)] = value
        raw, acting = {}, {}
        for table, values in points.items():
            column = names.index(letters[words["INPUT_AXIS", table]])
            low, high, step = (float(words[word, table]) for word in ("MIN", "MAX", "STEP"))
            x = q[:, column]
            if words["IS_MODULO", table] == "1":
                x = low + np.mod(x - low, high - low)
            last = round((high - low) / step)
            raw[table] = np.interp(x, low + step * np.arange(last + 1), [values[k] for k in range(last + 1)])
            way = int(words["DIRECTION", table])
            acting[table] = np.ones(len(q)) if way == 0 else (ways[:, column] == way).astype(float)
        multipliers = {int(words["MULT_BY_TABLE", table]) - 1 for table in points} - {-1}
        terms, sign = said["product_terms"], 1 if said["value_sign"] == "correction" else -1
        for table in points:
            other = int(words["MULT_BY_TABLE", table]) - 1
            value = raw[table] * raw[other] if other >= 0 else np.zeros(len(q))
            plain = (
                (terms in ("plus_base", "plus_both"))
                if other >= 0
                else (table not in multipliers or terms in ("plus_multiplier", "plus_both"))
            )
            value = acting[table] * (value + (raw[table] if plain else 0.0))
            found[:, names.index(letters[words["OUTPUT_AXIS", table]])] += sign * value
    return found


def _eec(text: str, letters: Texts, names: Sequence[str], q: Array) -> Array:
    found = np.zeros_like(q)
    values = re.findall(r"\$AA_ENC_COMP\[0,(\d+),(\w+)\]=(\S+)", text)
    words = dict(re.findall(r"\$AA_ENC_COMP_(\w+)\[0,\w+\]=(\S+)", text))
    low, high, step = (float(words[word]) for word in ("MIN", "MAX", "STEP"))
    column = names.index(letters[values[0][1]])
    x = q[:, column]
    x = low + np.mod(x - low, high - low) if words["IS_MODULO"] == "1" else x
    by_place = {int(place): float(value) for place, _, value in values}
    last = round((high - low) / step)
    found[:, column] = -np.interp(x, low + step * np.arange(last + 1), [by_place[k] for k in range(last + 1)])
    return found


def _cell(lines: Sequence[Array], values: Array, at: Array) -> Array:
    """Multilinear in the cell: the sum over its corners (A-79351E has the eight terms of it)."""
    places, shares = [], []
    for axis, line in enumerate(lines):
        x = np.clip(at[:, axis], line[0], line[-1])
        k = np.clip(np.searchsorted(line, x, side="right") - 1, 0, len(line) - 2)
        places.append(k)
        shares.append((x - line[k]) / (line[k + 1] - line[k]))
    total = np.zeros((len(at), values.shape[-1]))
    for corner in product((0, 1), repeat=len(lines)):
        weight = np.prod([s if up else 1 - s for up, s in zip(corner, shares, strict=True)], axis=0)
        total += weight[:, None] * values[tuple(k + up for k, up in zip(places, corner, strict=True))]
    return total


def _lines(record: Mapping[str, Any], unit: str) -> list[Array]:
    """By the parameters alone: reference position, number of the point there, interval, count."""
    parts = (record[f"reference_{unit}"], record["reference_points"], record[f"interval_{unit}"], record["counts"])
    return [at + (np.arange(count) - (point - 1)) * step for at, point, step, count in zip(*parts, strict=True)]


def _play(files: Texts, names: Sequence[str], ways: Array, unit: float, home_minus: str) -> Array:
    """Parameter 1851: added, in the direction of motion, while an axis moves against its reference return."""
    found = np.zeros(ways.shape)
    for number, value in re.findall(r"A(\d)P([-\d.]+)", files.get("backlash.txt", "").partition("01851")[2]):
        letter = "XYZ"[int(number) - 1]
        column, against = names.index(letter), 1 if letter in home_minus else -1
        found[:, column] = np.where(ways[:, column] == against, against * float(value) * unit, 0.0)
    return found


def fanuc(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """Points from 1, the axes of `order` fastest first; 24 points of three values a record."""
    record = json.loads(files["volume.json"])
    data = np.array([value for each in record["records"] for value in each["data"]], dtype=float).reshape(-1, 3)
    order = ["XYZ".index(letter) for letter in record["order"]]
    counts = record["counts"]
    slow_first = [counts[axis] for axis in reversed(order)]
    grid = np.moveaxis(data.reshape(*slow_first, 3), [0, 1, 2], [*reversed(order)])
    unit = record["detection_unit_um"] / 1000
    columns = [names.index(letter) for letter in "XYZ"]
    sign = 1 if said["sign"] == "correction" else -1
    found = _play(files, names, ways, unit, record["home_minus"])
    found[:, columns] += sign * record["magnification"] * unit * _cell(_lines(record, "mm"), grid, q[:, columns])
    return found


def fanuc_rotary(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts, length: float) -> Array:
    """FROT-2 and FROT-4: shifts, and turns times levers."""
    columns = [names.index(letter) for letter in "XYZ"]
    sign = 1 if said["sign"] == "correction" else -1
    lattices = {}
    for name, unit in (("rotary.json", "mm"), ("rotary-axes.json", "deg")):
        if name in files:
            record = json.loads(files[name])
            rows = [[*each["lin"], *each["rot"]] for each in sorted(record["records"], key=lambda each: each["no"])]
            scale = [record["magnification"] * record["detection_unit_um"] / 1000] * 3
            scale += [record["angle_magnification"] * np.radians(record["detection_unit_deg"])] * 3
            counts = record["counts"]
            values = sign * np.array(rows, dtype=float) * scale
            values = values.reshape(*reversed(counts), 6).transpose(*reversed(range(len(counts))), len(counts))
            lattices[name] = record, _lines(record, unit), values
    record, lines, values = lattices["rotary.json"]
    tool = np.array([0, 0, -length])
    found = _play(files, names, ways, record["detection_unit_um"] / 1000, record["home_minus"])
    six = _cell(lines, values, q[:, columns])
    found[:, columns] += six[:, :3] + np.cross(six[:, 3:], tool)
    if "rotary-axes.json" in lattices:
        record, lines, values = lattices["rotary-axes.json"]
        six = _cell(lines, values, q[:, [names.index(letter) for letter in record["axes"]]])
        lever = q[:, columns] + tool - np.array(record["centre_mm"])
        found[:, columns] += six[:, :3] + np.cross(six[:, 3:], lever)
    return found


def fanuc_pitch(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """Increments from the negative end, zero at the reference position: B-63980EN, p. 100."""
    sign = 1 if said["sign"] == "correction" else -1
    found = np.zeros_like(q)
    parameters: dict[int, dict[int, float]] = {}
    for row in files.get("parameters.txt", "").splitlines():
        if match := re.match(r"N0(\d{4})(.*);", row):
            parameters[int(match[1])] = {int(n): float(v) for n, v in re.findall(r"A(\d)P([-\d.]+)", match[2])}
    numbers = {letter: n for n, letter in enumerate((c for c in "XYZABCUVW" if c in names), 1)}
    for letter, n in numbers.items():
        if f"pitch_{letter}.csv" not in files:
            continue
        rows = re.findall(r"^(\d+),(-?\d+)$", files[f"pitch_{letter}.csv"], re.MULTILINE)
        value = {int(number): int(increment) for number, increment in rows}
        reference, low, high = (int(parameters[number][n]) for number in (3620, 3621, 3622))
        magnification, step, turn = (parameters[number][n] for number in (3623, 3624, 3625))
        at = float((re.search(letter + r"([-\d.]+)", said["reference"]) or "00")[1])
        places = at + (np.arange(low, high + 1) - reference) * step
        sums = np.array([sum(value[k] for k in range(low + 1, point + 1)) for point in range(low, high + 1)], float)
        x = q[:, names.index(letter)]
        x = places[0] + np.mod(x - places[0], turn) if turn else x
        total = np.interp(x, places, sums) - np.interp(at, places, sums)
        unit = float(said["detection_unit_deg"]) if letter in ROTARY else float(said["detection_unit_um"]) / 1000
        found[:, names.index(letter)] = sign * magnification * unit * total
    return found


def _com(text: str) -> tuple[Array, dict[str, Array]]:
    """Positions and columns of a .COM file, of either family."""
    head, titles, *rows = [line for line in text.splitlines() if line.strip() and line.strip() != "[END]"]
    cells = [dict(zip(titles.split(), row.split(), strict=True)) for row in rows]
    columns = {title: np.array([float(cell[title]) for cell in cells]) for title in titles.split()[1:]}
    if "AXISPOS" in columns:
        return columns.pop("AXISPOS"), columns
    datum, distance = (float(re.search(word + r":(\S+)", head)[1]) for word in ("DATUM", "DISTANCE"))  # type: ignore[index]
    return datum + distance * np.arange(len(rows)), columns


def _inputs(files: Texts) -> dict[str, tuple[Array, dict[str, Array]]]:
    _, titles, *rows = files["config.cma"].splitlines()
    row = next(row for row in rows if "*" in row)
    starts = {found[0]: found.start() for found in re.finditer(r"\S+", titles)}
    named = {letter: row[start:].split(" ", 1)[0] for letter, start in starts.items() if len(letter) == 1}
    return {letter: _com(files[name]) for letter, name in named.items() if name in files}


def heidenhain(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """[axis of the column] = F([axis under whose name config.cma has the .COM file])."""
    sign = 1 if said["sign"] == "correction" else -1
    order = [letter for letter in "XYZABCUVW" if letter in names]
    found = np.zeros_like(q)
    for source, (places, columns) in _inputs(files).items():
        x = q[:, names.index(source)]
        for title, values in columns.items():
            if title.startswith("BACKLASH"):
                continue
            output = order[int(title.split("=")[0]) - 1] if "=" in title else title
            curve = np.interp(x, places, values)
            back = next((key for key in columns if key.startswith("BACKLASH")), "")
            if output == source and back:
                curve = np.where(ways[:, names.index(source)] < 0, np.interp(x, places, columns[back]), curve)
            found[:, names.index(output)] += sign * curve
    return found


def isg(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts) -> Array:
    """TF5280: E, direction, axis; errors, taken off. TF5200: kw.ssfk, error = .pos or .neg times 0.1 um."""
    found = np.zeros_like(q)
    listed = re.findall(r"^file\[\d+\]\s+\S*\\(\S+)$", files.get("volcomp.lis", ""), re.MULTILINE)
    turned = (re.search(r"^negate\s+\"?([XYZ]+)", files.get("volcomp.lis", ""), re.MULTILINE) or ["", ""])[1]
    for name in listed:
        head, *rows = [row for row in files[name].splitlines() if not row.startswith("//")]
        titles = head.split()
        inputs = [title for title in titles if len(title) == 1]
        table = np.array([[float(word) for word in row.split()] for row in rows])
        lines = [np.unique(table[:, k]) for k in range(len(inputs))]
        values = np.zeros((*map(len, lines), len(titles) - len(inputs)))
        for row in table:
            places = tuple(int(np.searchsorted(line, x)) for line, x in zip(lines, row, strict=False))
            values[places] = row[len(inputs) :]
        at = _cell(lines, values, q[:, [names.index(letter) for letter in inputs]])
        for k, title in enumerate(titles[len(inputs) :]):
            found[:, names.index(title[1])] -= at[:, k] * (-1 if title[1] in turned else 1)
    for name, text in files.items():
        if name.startswith("leadscrew_"):
            letter = name[len("leadscrew_")]
            rows = re.findall(r"table\[(\d+)\]\.(setpoint|pos|neg)\s+(\S+)", text)
            parts: dict[str, dict[int, float]] = {"setpoint": {}, "pos": {}, "neg": {}}
            for n, key, value in rows:
                parts[key][int(n)] = float(value) * 1e-4
            nodes, there, back = ([part[n] for n in sorted(part)] for part in parts.values())
            column = names.index(letter)
            x = q[:, column]
            found[:, column] -= np.where(ways[:, column] > 0, np.interp(x, nodes, there), np.interp(x, nodes, back))
    return found


def kinematics(files: Texts, names: Sequence[str], q: Array, ways: Array, said: Texts, length: float) -> Array:
    """KINE-1: head from the base to the tool, then MachBase, then table; what moves X, Y and Z takes the error off."""
    sign = -1 if said["sign"] == "correction" else 1
    angle = np.pi / 180 if said["angle_unit"] == "deg" else 1.0
    order = [letter for letter in "XYZABCUVW" if letter in names]
    tables = _inputs(files)
    rows = [line.split() for line in files["kinematics.tab"].splitlines()[1:] if line.strip() != "[END]"]
    spaced = [line for line in files["kinematics.tab"].splitlines()[1:] if line.strip() != "[END]"]

    def motion(letter: str, value: Array) -> Array:
        found = np.tile(np.eye(4), (len(value), 1, 1))
        k = "XYZABC".index(letter)
        if k < 3:
            found[:, k, 3] = value
        else:
            i, j = [(1, 2), (2, 0), (0, 1)][k - 3]
            found[:, i, i] = found[:, j, j] = np.cos(value)
            found[:, j, i] = np.sin(value)
            found[:, i, j] = -np.sin(value)
        return found

    def tip(q: Array, wrong: bool) -> Array:
        side, chains = 0, [np.tile(np.eye(4), (len(q), 1, 1)) for _ in range(2)]
        for row, line in zip(rows, spaced, strict=True):
            if row[1] == "MachBase":
                side = 1
                continue
            letter = row[2]
            unit = np.pi / 180 if letter in ROTARY else 1.0
            if row[1] == "MachAxis":
                value = q[:, names.index(letter)] * unit * (-1 if side else 1)
                step = motion(letter, value)
            else:
                coord, error = line[21:37].strip(), line[37:].strip()
                value = np.full(len(q), float(coord or 0) * unit)
                if wrong and error:
                    scale = sign * (angle if letter in ROTARY else 1.0)
                    if ".." in error:
                        source, column = error.split("..")
                        places, columns = tables[source]
                        value = value + scale * np.interp(q[:, names.index(source)], places, columns[column])
                    else:
                        value = value + scale * float(error)
                step = motion(letter, value)
            chains[side] = chains[side] @ step
        seen = np.linalg.inv(chains[1]) @ chains[0] @ np.array([0, 0, -length, 1])
        return np.asarray(seen[:, :3])

    found = heidenhain_own(tables, order, names, q, ways, said)
    columns = [names.index(letter) for letter in "XYZ"]
    meant, moved = tip(q, False), q.copy()
    for _ in range(4):
        gap = meant - tip(moved, True)
        slope = np.stack([tip(moved + np.eye(q.shape[1])[c], True) - tip(moved, True) for c in columns], axis=-1)
        moved[:, columns] += np.linalg.solve(slope, gap[..., None])[..., 0]
    found[:, columns] += (moved - q)[:, columns]
    return found


def heidenhain_own(
    tables: Mapping[str, tuple[Array, dict[str, Array]]],
    order: Sequence[str],
    names: Sequence[str],
    q: Array,
    ways: Array,
    said: Texts,
) -> Array:
    """The column n=F() of the axis itself, and BACKLASH while it goes towards minus."""
    sign = 1 if said["sign"] == "correction" else -1
    found = np.zeros_like(q)
    for source, (places, columns) in tables.items():
        title = f"{order.index(source) + 1}=F()"
        if title in columns:
            x = q[:, names.index(source)]
            curve = np.interp(x, places, columns[title])
            if "BACKLASH" in columns:
                curve = np.where(ways[:, names.index(source)] < 0, np.interp(x, places, columns["BACKLASH"]), curve)
            found[:, names.index(source)] += sign * curve
    return found
