"""`ncfix effects`: components, physical effects, bases."""

from __future__ import annotations


def names(found) -> dict[str, dict[str, str]]:
    return {row["name"]: row for row in found["effects"]}


def test_components_and_physical_effects_are_listed(ncfix):
    rows = names(ncfix("effects", "--json").json())
    assert rows["EYX"]["title"] == "straightness of X in Y"
    assert rows["EYX"]["basis"] == "polynomial degree 2 up"
    assert rows["EXC"]["basis"] == "fourier order 2 up"
    assert rows["ECC"]["basis"] == "fourier order 1 up"
    assert rows["EC0Y"]["squareness"].startswith("+X to +Y is 90 deg")
    assert rows["backlash-X"] == {
        "name": "backlash-X",
        "unit": "mm",
        "title": "play of X when it reverses",
        "basis": "EXX backlash",
        "much": "0.01",
        "seen by": "tcp tcp6 probe length axis",
        "needs": "dir_X",
        "squareness": "",
    }
    assert rows["warming-Z"]["needs"] == "temp_structure time_s"
    assert rows["backlash-C"]["unit"] == "rad"


def test_those_of_a_machine(ncfix, examples):
    rows = names(ncfix("effects", "-m", examples / "machines" / "three_axis.toml", "--json").json())
    assert "load-X" in rows
    assert "moment-Y" in rows
    assert "EXC" not in rows
    assert "backlash-C" not in rows


def test_every_name_without_a_zero_size_is_accepted_in_a_machine_file(ncfix, examples, tmp_path):
    """What is listed can be written: each physical effect with as many coefficients as the message asks for."""
    shipped = (examples / "machines" / "three_axis.toml").read_text()
    head = shipped[: shipped.index("[[effect]]")]
    path = tmp_path / "m.toml"
    for name in names(ncfix("effects", "-m", examples / "machines" / "three_axis.toml", "--json").json()):
        if "-" in name:
            path.write_text(
                f'{head}\n[[effect]]\nname = "{name}"\ncoefficients = [1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6]\n'
            )
            done = ncfix("machine", "check", path)
            assert (done.code, f"7 coefficients, but {name} has" in done.err + done.out.decode()) == (3, True), done.err


def test_bases_have_their_keys(ncfix):
    rows = {row["name"]: row for row in ncfix("effects", "--bases", "--json").json()["bases"]}
    assert rows["truncated"]["keys"] == "knots, degree, powers, detrended"
    assert ncfix("effects").code == 0
