"""`ncfix report`: machines and results on a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ncfix.cli.shop.batch_page import batch_page
from ncfix.diagnostics import ExitCode
from ncfix.reports.content import is_of_fix, result_sections


def test_every_shipped_machine_has_a_page(ncfix: Any, examples: Path, tmp_path: Path) -> None:
    machines = sorted((examples / "machines").glob("*.toml"))
    assert ncfix("report", *machines, "-o", tmp_path / "machines.html").code == ExitCode.DONE
    page = (tmp_path / "machines.html").read_text()
    assert page.count("Error of the tool tip") == len(machines)
    assert "NaN" not in page
    assert "nan" not in page


def test_a_perfect_machine_has_one_too(ncfix: Any, shop: Any) -> None:
    assert ncfix("report", shop.perfect, "-o", shop.folder / "page.md").code == ExitCode.DONE
    assert "None." in (shop.folder / "page.md").read_text()


def results(ncfix: Any, shop: Any) -> dict[str, bytes]:
    """What verbs print with --json."""
    on, fixed, tables = ("-m", shop.machine), shop.folder / "fixed.ngc", shop.folder / "tables"
    fix = ncfix("fix", shop.program, *on, "--assume-zero", "-o", fixed, "--json").out
    return {
        "Programs": fix,
        "Verification": ncfix("verify", shop.program, fixed, *on, "--assume-zero", "--json").out,
        "Simulation": ncfix("simulate", *on, "--program", shop.program, "--assume-zero", "--json").out,
        "Compensation tables": ncfix("export", "linuxcnc", *on, "-o", tables, "--json").out,
    }


def test_results_of_verbs_become_tables(ncfix: Any, shop: Any) -> None:
    found = results(ncfix, shop)
    paths = []
    for number, text in enumerate(found.values()):
        paths.append(shop.folder / f"result{number}.json")
        paths[-1].write_bytes(text)
    page = shop.folder / "page.md"
    assert ncfix("report", *paths, shop.machine, "-o", page).code == ExitCode.DONE
    text = page.read_text()
    assert all(f"## {heading}: " in text for heading in found)
    entry = json.loads(found["Programs"])["files"][0]
    assert f"{entry['error_before_um']['max']:.2f} ({entry['error_before_um']['rms']:.2f})" in text
    assert "NCF206" in text or "assumed" in text or "zero" in text


@pytest.mark.parametrize("text", ['{"a": 1}', "{nothing", '{"schema": 7}'])
def test_what_is_no_result_is_refused(ncfix: Any, shop: Any, text: str) -> None:
    path = shop.folder / "result.json"
    path.write_text(text)
    result = ncfix("report", path, "-o", shop.folder / "page.html")
    assert result.code == ExitCode.UNREADABLE
    assert "NCF019" in result.err
    assert not (shop.folder / "page.html").exists()


def test_a_page_is_not_written_over_what_it_shows(ncfix: Any, shop: Any) -> None:
    result = ncfix("report", shop.machine, "-o", shop.machine, "--force")
    assert result.code == ExitCode.USAGE
    assert "NCF005" in result.err or "NCF018" in result.err


@pytest.mark.parametrize("value", [None, 1, "x", [], [1], {}, [{}], {"max": "x"}, [{"code": 1, "text": None}]])
def test_a_result_that_was_changed_by_hand_makes_a_page_all_the_same(ncfix: Any, shop: Any, value: Any) -> None:
    """Each field of what `fix` printed of two programs in turn is something else."""
    entry = json.loads(results(ncfix, shop)["Programs"])["files"][0]
    refused = {**entry, "output": None, "refused": [{"line": 1, "code": "NCF432", "reason": "no"}]}
    assert is_of_fix(entry)
    assert is_of_fix(refused)
    for each in (entry, refused):
        for key in each:
            files = [{**each, key: value}, entry]
            assert result_sections({"schema": 1, "files": files}, "night.json")
            if all(map(is_of_fix, files)):
                assert b"Batch" in batch_page(files)


def test_a_calibration_has_expanded_uncertainties_and_units() -> None:
    rows = [
        {"name": "EXX u^1", "value": 0.006, "sigma": 0.0002, "held": False},
        {"name": "EC0Y", "value": 25e-6, "sigma": None, "held": True},
    ]
    (section,) = result_sections({"parameters": rows, "covariance": [[1.0]], "freedom": 12}, "result.json")
    table = section.parts[0]
    assert list(table.rows) == [("EXX u^1", "6", "0.2", "0.4", "um"), ("EC0Y", "25", "held", "", "urad")]
    assert "degrees of freedom" in str(section.parts)
    (other,) = result_sections({"parameters": [{"name": "EXX", "value": "many"}]}, "result.json")
    assert "many" in str(other.parts)
