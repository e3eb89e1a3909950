"""Files that are given for one another are told by what they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.cli import main
from objstate.kinds import BUILDING, DOORS, MAP, PATH, SCENE, TRUTH, instead, kind_of

ROOT = Path(__file__).parents[1]
LOG = ROOT / "logs" / "corridor.mcap"
TRUTH_FILE, PATH_FILE = ROOT / "logs" / "corridor.truth.csv", ROOT / "logs" / "corridor.path.tum"
URDF = ROOT / "models" / "corridor" / "corridor.urdf"
SCENE_FILE = ROOT / "models" / "corridor" / "corridor.scene.yaml"


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    contents = {
        "map.yaml": "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n",
        "map.pgm": "P2\n1 1\n255\n0\n",
        "doors.csv": "door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg\n",
        "settings.yaml": "localization: {alpha1: 0.2}\n",
        "run.log": "# a log\nPARAM robot_front_laser_max 81.9\nFLASER 1 1.0 0 0 0 0 0 0 1 h 1\n",
    }
    for name, text in contents.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "result").mkdir()
    (tmp_path / "result" / "run.json").write_text("{}")
    named = {name: tmp_path / name for name in (*contents, "result")}
    return named | {
        "log": LOG, "truth": TRUTH_FILE, "path": PATH_FILE, "urdf": URDF, "scene": SCENE_FILE,
    }  # fmt: skip


def test_each_kind_of_file_is_known_by_its_content(files: dict[str, Path]) -> None:
    assert {name: kind_of(path) for name, path in files.items()} == {
        "map.yaml": MAP,
        "map.pgm": "an image",
        "doors.csv": DOORS,
        "settings.yaml": None,
        "run.log": "a log (CARMEN)",
        "result": "a result of `objstate estimate`",
        "log": "a log (MCAP)",
        "truth": TRUTH,
        "path": PATH,
        "urdf": BUILDING,
        "scene": SCENE,
    }


def test_what_is_wanted_or_unknown_is_not_told(files: dict[str, Path], tmp_path: Path) -> None:
    assert instead(LOG, "a log") is instead(URDF, BUILDING) is None
    assert instead(files["settings.yaml"], "a log") is instead(tmp_path / "none", "a log") is None
    (tmp_path / "empty").touch()
    assert kind_of(tmp_path / "empty") is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("estimate {urdf} --building {log} --out {out}", "corridor.mcap is a log (MCAP), not a b"),
        ("estimate {urdf} --building {urdf} --out {out}", "is a building (URDF), not a log"),
        ("estimate {result} --building {urdf} --out {out}", "is a result of `objstate estimate`, not"),
        ("estimate {log} --building {scene} --out {out}", "is a scene, not a building"),
        ("estimate {log} --building {map.yaml} --out {out}", "`objstate building from-map` makes"),
        ("estimate {log} --building {map.pgm} --out {out}", "`objstate building from-map` makes"),
        ("estimate {log} --building {urdf} --config {scene} --out {out}", "is a scene, not settings"),
        ("estimate {log} --building {urdf} --config {log} --out {out}", "is a log (MCAP), not a YAML"),
        ("estimate {log} --building {urdf} --truth {path} --out {out}", "is a path (TUM), not a table"),
        ("building from-map {map.pgm} --out {out}", "give the .yaml file that lies beside it"),
        ("building from-map {urdf} --out {out}", "is a building (URDF), not a map"),
        ("building from-map {doors.csv} --doors {map.yaml} --out {out}", "is a table of doors, not a m"),
        ("building from-map {map.yaml} --doors {truth} --out {out}", "is a table of true states, not"),
        ("simulate {urdf} --out {out}", "is a building (URDF), not a YAML file"),
        ("evaluate {truth} --truth {result}", "is a table of true states, not a result"),
        ("evaluate {log} --truth {truth}", "is a log (MCAP), not a result"),
        ("report {log}", "is a log (MCAP), not a result"),
        ("convert {urdf} {out}.mcap", "is a building (URDF), not a log"),
        ("inspect {map.yaml}", "is a map (YAML), which isn't inspected; make a building of it"),
        ("inspect {scene}", "is a scene, which isn't inspected; see `objstate simulate`"),
    ],
)  # fmt: skip
def test_exchanged_arguments_are_named(
    files: dict[str, Path], tmp_path: Path, arguments: str, message: str, capsys
) -> None:
    words = arguments.split()
    for name, path in (files | {"out": tmp_path / "out"}).items():
        words = [word.replace(f"{{{name}}}", str(path)) for word in words]
    assert main(words) == 1
    told = capsys.readouterr().err
    assert message in told
    assert len(told.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_than_commas_are_named(
    files: dict[str, Path], tmp_path: Path, separator: str, capsys
) -> None:
    for name, text in {
        "doors.csv": files["doors.csv"].read_text() + "a,1,2,0,cw,0.9,90\n",
        "truth.csv": "stamp,object,coordinate,value\n0,door_01,angle,1\n",
        "logs.csv": "log,initial_pose\na.mcap,\n",
    }.items():
        (tmp_path / name).write_text(text.replace(",", separator))
    called = {";": "semicolons", "\t": "tabs"}[separator]
    out = ("--out", str(tmp_path / "out"))
    for words in (
        [
            "building",
            "from-map",
            str(files["map.yaml"]),
            "--doors",
            str(tmp_path / "doors.csv"),
            *out,
        ],
        [
            "estimate",
            str(LOG),
            "--building",
            str(URDF),
            "--truth",
            str(tmp_path / "truth.csv"),
            *out,
        ],
        ["batch", str(tmp_path / "logs.csv"), "--building", str(URDF), *out],
    ):
        if words[0] == "building":
            (tmp_path / "map.pgm").write_text("P2\n2 2\n255\n0 0 0 0\n")
        assert main(words) == 1
        assert f"separated by {called}; save it with commas" in capsys.readouterr().err


def test_a_folder_of_bags_says_how_to_name_them(tmp_path: Path, capsys) -> None:
    for name in ("one.bag", "two.bag"):
        (tmp_path / name).write_bytes(b"#ROSBAG V2.0\n")
    assert main(["inspect", str(tmp_path)]) == 1
    told = capsys.readouterr().err
    assert "a folder of 2 logs (one.bag, two.bag)" in told
    assert f"objstate batch {tmp_path}" in told
