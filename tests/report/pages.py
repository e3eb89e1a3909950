"""A small simulated drive with its result, and its report taken apart."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import astuple, replace
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import polars as pl

from objstate.recording.tables import estimate_schema
from objstate.records import Estimate
from objstate.run import estimate_log
from objstate.simulation import simulate

WALLS = "".join(
    f'<collision><origin xyz="{x} {y} 1"/><geometry><box size="{w} {d} 2"/></geometry></collision>'
    for x, y, w, d in ((2, -2, 8, 0.1), (-2, 0, 0.1, 4), (6, 0, 0.1, 4), (0, 2, 4, 0.1),
                       (4.45, 2, 3.1, 0.1), (2, 4, 8, 0.1))
)  # fmt: skip
LEAF = (
    '<collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>'
)
CHEST = (
    '<collision><origin xyz="0 0 0.4"/><geometry><box size="0.8 0.5 0.8"/></geometry></collision>'
)
ROOM = f"""
<robot name="room">
  <link name="map">{WALLS}</link>
  <link name="leaf">{LEAF}</link><link name="far">{LEAF}</link><link name="body">{CHEST}</link>
  <joint name="office_door" type="revolute">
    <parent link="map"/><child link="leaf"/><origin xyz="2 2 0"/><axis xyz="0 0 -1"/>
    <limit lower="0" upper="1.6" effort="0" velocity="0"/>
  </joint>
  <joint name="far &lt;door&gt;" type="revolute">
    <parent link="map"/><child link="far"/><origin xyz="90 2 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.6" effort="0" velocity="0"/>
  </joint>
  <joint name="chest" type="planar">
    <parent link="map"/><child link="body"/><origin xyz="4 -1.2 0"/><axis xyz="0 0 1"/>
  </joint>
</robot>
"""
SCENE = """
building: room.urdf
route: {waypoints: [{x: 0.5, y: 0.0, pause: 0.5}, {x: 2.5, y: 0.3, pause: 0.5}]}
lasers: [{frame: laser, rate: 10.0, range_max: 10.0}]
objects: [{name: office_door, initial: 0.6}]
"""


def make_result(folder: Path) -> Path:
    """The result of a drive past a door, a chest, and a door that is never near; truth is known."""
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    drive = simulate(folder / "room.scene.yaml", folder / "log")
    truth, path = drive.log.parent / "truth.csv", drive.log.parent / "path.tum"
    out = folder / "out"
    estimate_log([drive.log], folder / "room.urdf", out, truth=truth, true_path=path)
    return out


def as_table(estimates: Sequence[Estimate]) -> pl.DataFrame:
    """Estimates as ``read_estimates`` would give them."""
    rows = [astuple(replace(each, median=each.value)) for each in estimates]
    return pl.DataFrame(rows, schema=estimate_schema(), orient="row")


class Reader(HTMLParser):
    """Holds that elements are closed in order, and gathers what a page refers to."""

    VOID = frozenset({"meta", "input", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.references += [value or "" for key, value in attrs if key in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"script", "style"} & set(self.open):
            self.words.append(data)


def read(page: str) -> Reader:
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def data_of(page: str) -> dict[str, Any]:
    """What the page's script moves the plan by."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    return dict(json.loads(found[1]))


def policy_of(page: str) -> str:
    """What the page lets run and load."""
    found = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert found
    return found[1]


def program_of(page: str) -> str:
    """The page's script."""
    (found,) = re.findall(r"<script>(.*?)</script>", page, re.S)
    return str(found)


def rows_of(page: str) -> list[tuple[str, str]]:
    """The objects of the table of states with what is made of them, in order."""
    found = re.search(r'<table class="[^"]*states">.*?<tbody>(.*?)</tbody>', page, re.S)
    assert found
    rows = re.findall(r'<tr ([^>]*)><th scope="row">(.*?)</th>', found[1])
    classes = (re.search(r'class="(\w+)"', attributes) for attributes, _ in rows)
    return [
        (name, found[1] if found else "") for (_, name), found in zip(rows, classes, strict=True)
    ]


def renamed(result: Path, old: str, new: str) -> None:
    """Give an object another name, in the building and everywhere in a result; no truth remains."""
    urdf = result.parent / "room.urdf"
    urdf.write_text(urdf.read_text().replace(f'name="{old}"', f'name="{escape(new)}"'))
    summary = json.loads((result / "run.json").read_text())
    summary["objects"] = [new if name == old else name for name in summary["objects"]]
    summary["inputs"].pop("truth", None)
    summary["symmetry"] = {}
    (result / "run.json").write_text(json.dumps(summary))
    for name in ("estimates.parquet", "smoothed.parquet", "posteriors.parquet"):
        rows = pl.read_parquet(result / name)
        rows.with_columns(pl.col("object").replace(old, new)).write_parquet(result / name)
