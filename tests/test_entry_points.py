"""Entry points are found as `importlib.metadata` finds them, without importing it."""

import importlib.metadata
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from ncfix import entry_points as module
from ncfix.entry_points import InstalledEntryPoint, entry_points


def installed(folder: Path, name: str, points: str, metadata: str = "", suffix: str = ".dist-info") -> None:
    """Put the metadata of a distribution into a folder."""
    info = folder / f"{name}{suffix}"
    info.mkdir(parents=True)
    (info / ("METADATA" if suffix == ".dist-info" else "PKG-INFO")).write_text(metadata)
    (info / "entry_points.txt").write_text(points)


def both_ways(group: str) -> list[tuple[str, str, str, str | None, str | None]]:
    """What is found, which must be what Python finds."""
    ours = [
        (p.name, p.value, p.module, p.dist.metadata["Name"], p.dist.metadata["Version"]) for p in entry_points(group)
    ]
    theirs = importlib.metadata.entry_points(group=group)
    assert sorted(ours, key=str) == sorted(
        ((p.name, p.value, p.module, p.dist.metadata["Name"], p.dist.metadata["Version"]) for p in theirs), key=str
    )
    return ours


@pytest.mark.parametrize("group", ["ncfix", "console_scripts", "pytest11", "not.there"])
def test_what_is_installed_is_found_as_python_finds_it(group: str) -> None:
    assert bool(both_ways(group)) == (group != "not.there")


def test_odd_metadata_is_read_as_python_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    points = (
        "\n# a remark\n[other]\na = b\n[a.group]\n  one = json\n\ntwo=json.decoder : JSONDecoder [extra]\n[x]\ny = z\n"
    )
    installed(first, "Some_Thing-1.0", points, "Metadata-Version: 2.1\nname: Some.Thing\nVersion: 1.0\n\nVersion: 9\n")
    installed(second, "some.thing-2.0", "[a.group]\nthree = json\n", "Name: some.thing\nVersion: 2.0\n")
    installed(second, "egg-3", "[a.group]\nfour = json:dumps\n", "Name: egg\nVersion: 3\n", ".egg-info")
    installed(second, "bare-1", "[a.group]\nfive = json\n")
    monkeypatch.setattr(sys, "path", [str(first), str(second), str(tmp_path / "not_there"), *sys.path])
    found = both_ways("a.group")
    assert [name for name, *_ in found] == ["one", "two", "four", "five"] or {name for name, *_ in found} == {
        "one", "two", "four", "five",
    }  # fmt: skip
    assert ("one", "json", "json", "Some.Thing", "1.0") in found


@pytest.mark.parametrize("value", ["json", "json:dumps", "json.decoder : JSONDecoder.decode [extra]", "json:absent"])
def test_a_value_leads_to_what_python_makes_of_it(value: str) -> None:
    found = []
    for point in (InstalledEntryPoint("a", value, None), importlib.metadata.EntryPoint("a", value, "g")):  # type: ignore[arg-type]
        try:
            found.append((point.module, point.load()))
        except AttributeError as error:
            found.append((point.module, str(error)))
    assert found[0] == found[1]


@pytest.mark.parametrize("kind", ["zip", "finder"])
def test_distributions_elsewhere_are_left_to_python(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind == "zip":
        with ZipFile(tmp_path / "all.zip", "w") as archive:
            archive.writestr("zipped-1.dist-info/METADATA", "Name: zipped\nVersion: 1\n")
            archive.writestr("zipped-1.dist-info/entry_points.txt", "[a.group]\none = json\n")
        monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path / "all.zip")])
        assert [name for name, *_ in both_ways("a.group")] == ["one"]
    else:

        class Finder:
            @classmethod
            def find_distributions(cls, context: object = None) -> list[object]:
                return []

        monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, Finder])
        monkeypatch.setattr(module, "_distributions", lambda folder: pytest.fail("looked itself"))
        assert entry_points("ncfix")
