"""The pages under docs/files list exactly the keys, columns and defaults that the code has."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import BaseModel

from objstate import config
from objstate.batch.manifest import COLUMNS as MANIFEST_COLUMNS
from objstate.building.door_table import COLUMNS as DOOR_COLUMNS
from objstate.building.door_table import TRAVEL
from objstate.recording.batches import summary_schema, timings_schema
from objstate.recording.candidates import Found
from objstate.recording.events import event_schema
from objstate.recording.grids import clutter_schema
from objstate.recording.posteriors import posterior_schema
from objstate.recording.scans import scan_schema
from objstate.recording.tables import COLUMNS as ESTIMATE_COLUMNS
from objstate.run import RunResult
from objstate.service.operations import OPERATIONS
from objstate.simulation import scene

ROOT = Path(__file__).parents[1]
FILES = ROOT / "docs" / "files"

GROUPS = {
    "`scans`": config.ScanSettings,
    "`beam_model`": config.BeamModelSettings,
    "`localization`": config.LocalizationSettings,
    "`object_updates`": config.ObjectUpdateSettings,
    "`building_error`": config.BuildingErrorSettings,
    "`grid`": config.GridSettings,
    "`calendar`": config.CalendarSettings,
    "scene": scene.Scene,
    "scene: `route`": scene.Route,
    "scene: `odometry`": scene.OdometryNoise,
    "scene: `lasers`": scene.Laser,
    "scene: `objects`": scene.ObjectRule,
    "scene: `people`": scene.People,
    "scene: `boxes`": scene.Boxes,
    "scene: `model_error`": scene.ModelError,
    "scene: `initial_pose`": scene.InitialPose,
    "scene: `belief`": scene.RecordedBelief,
}


def page(name: str) -> str:
    """The text of a page about files."""
    return (FILES / f"{name}.md").read_text(encoding="utf-8")


def rows(heading: str) -> list[list[str]]:
    """The cells of all table rows below a heading, without the tables' own headings."""
    text = "\n".join(file.read_text(encoding="utf-8") for file in sorted(FILES.glob("*.md")))
    found = re.search(rf"^#+ {re.escape(heading)}$(.*?)(?=^#|\Z)", text, re.M | re.S)
    assert found, f"no heading '{heading}' in {FILES}"
    lines = [line for line in found[1].splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def listed(heading: str, column: int = 1) -> dict[str, str]:
    """What one column says of each key."""
    return {row[0].strip("`"): row[column] for row in rows(heading)}


def defaults(model: type[BaseModel]) -> dict[str, Any]:
    """The default of every key of a group, as YAML has it."""
    fields = model.model_fields.items()
    return {
        field.alias or name: yaml.safe_load(yaml.safe_dump(plain(field.get_default())))
        for name, field in fields
    }


def plain(value: Any) -> Any:
    """Groups as mappings and tuples as lists."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, tuple):
        return [plain(each) for each in value]
    return value if isinstance(value, int | float | str | bool | dict | None) else str(value)


def says(cell: str, default: Any) -> bool:
    """Whether a table's cell gives a default; words instead of code point to another table."""
    if cell.startswith("`"):
        return bool(yaml.safe_load(cell.strip("`")) == default)
    return isinstance(default, dict | list) or cell == ("" if default is None else "required")


@pytest.mark.parametrize("heading", GROUPS)
def test_every_key_is_listed_with_its_default(heading: str) -> None:
    told, true = listed(heading), defaults(GROUPS[heading])
    assert told.keys() == true.keys()
    wrong = {key: (told[key], true[key]) for key in told if not says(told[key], true[key])}
    assert wrong == {}


def test_every_group_of_settings_is_listed() -> None:
    groups = {f"`{name}`" for name in config.Settings.model_fields}
    assert groups - GROUPS.keys() == {"`objects`"}


@pytest.mark.parametrize(
    ("column", "model"), [(1, config.DoorSettings), (2, config.FurnitureSettings)]
)
def test_every_key_of_objects_is_listed_with_its_default(
    column: int, model: type[BaseModel]
) -> None:
    true = defaults(model)
    true |= true.pop("dynamics")
    settable = {"moves_per_hour", *config.ObjectRule.model_fields} - {"dynamics", "rest"}
    true = {key: value for key, value in true.items() if key in settable}
    told = listed("`objects`", column)
    told = {key: cell for key, cell in told.items() if key not in {"dynamics", "rest"}}
    assert {key for key, cell in told.items() if cell} == true.keys()
    wrong = {key: (told[key], true[key]) for key in true if not says(told[key], true[key])}
    assert wrong == {}


def test_every_share_of_rests_is_listed_with_its_default() -> None:
    true, told = defaults(config.Rest), listed("Where doors come to rest")
    assert told.keys() == true.keys()
    assert all(says(told[key], value) for key, value in true.items())


def test_every_key_of_a_rule_is_listed() -> None:
    told = listed("`objects`").keys() - config.Dynamics.model_fields.keys()
    assert told | {"match"} == defaults(config.ObjectRule).keys()


def test_the_example_is_understood() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", page("settings"), re.S)
    settings = config.parse_strict(config.Settings, yaml.safe_load(example), "the example")
    assert settings.localization.alpha1 != config.Settings().localization.alpha1
    assert settings.for_object("desk_1", "furniture").prior_std_m == 0.5


def test_the_columns_of_tables_are_listed() -> None:
    doors = " ".join(row[0] for row in rows("Door table: doors.csv"))
    estimates = " ".join(row[0] for row in rows("States: estimates.parquet"))
    assert set(re.findall(r"`(\w+)`", doors)) == {*DOOR_COLUMNS, TRAVEL}
    assert set(re.findall(r"`(\w+)`", estimates)) == set(ESTIMATE_COLUMNS)
    events = " ".join(row[0] for row in rows("Events: events.parquet"))
    assert set(re.findall(r"`(\w+)`", events)) == set(event_schema())
    assert list(listed("Posteriors: posteriors.parquet")) == list(posterior_schema())
    scans = " ".join(row[0] for row in rows("Scans: scans.parquet"))
    assert re.findall(r"`(\w+)`", scans) == list(scan_schema())


def test_the_columns_of_a_batch_are_listed() -> None:
    text = page("batch")
    for column in (*summary_schema(), *timings_schema()):
        coordinate, _, what = column.partition("_")
        short = f"{coordinate}_" if what in ("count", "error", "coverage") else column
        assert f"`{column}`" in text or f"`{short}`" in text, column
    manifest = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    assert all(f"`{column}`" in manifest for column in MANIFEST_COLUMNS)


def test_the_primary_settings_exist() -> None:
    groups = {name: set(group.model_fields) for name, group in groups_of_settings().items()}
    objects = set(config.DoorSettings.model_fields) | set(config.FurnitureSettings.model_fields)
    for row in rows("Primary settings"):
        for path in re.findall(r"`([a-z_.]+)`", row[0]):
            group, _, key = path.rpartition(".")
            known = {"": objects, "dynamics": set(config.Dynamics.model_fields)} | groups
            assert key in known[group], path


def groups_of_settings() -> dict[str, type[BaseModel]]:
    """The groups of settings that have one table each, by their keys."""
    return {key.strip("`"): group for key, group in GROUPS.items() if not key.startswith("scene")}


def test_the_keys_of_the_summary_are_listed() -> None:
    summary = RunResult(Path(), (), 0, 1.0, 1.0, {}, ()).to_dict()
    assert set(listed("`run.json`")) >= summary.keys()
    keys = re.findall(r"`(\w+)`", " ".join(row[0] for row in rows("`run.json`")))
    assert set(keys) == summary.keys() | {"options", "inputs"}


def test_what_stands_about_is_listed() -> None:
    found = [
        re.findall(r"`(\w+)`", row[0]) for row in rows("Obstacles that are not in the building")
    ]
    names = {name for each in found for name in each}
    assert names == set(clutter_schema()) | set(Found.__annotations__)


PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]


def test_every_operation_of_the_service_is_listed() -> None:
    page = (ROOT / "docs" / "service.md").read_text(encoding="utf-8")
    rows = [line.split(" | ")[0] for line in page.splitlines() if line.startswith("| `")]
    missing = [
        f"{each.method} {each.path}"
        for each in OPERATIONS
        if not any(each.method in row and f"{each.path}`" in row for row in rows)
    ]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_prose_wraps_at_100_characters(page: Path) -> None:
    lines = page.read_text(encoding="utf-8").splitlines()
    prose = [line for line in lines if not line.startswith(("|", "    "))]
    assert [line for line in prose if len(line) > 100] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.name)
def test_code_that_is_named_exists(page: Path) -> None:
    named = re.findall(r"`(\w+/[\w/]+\.py)(?:: (\w+))?[\w.]*`", page.read_text(encoding="utf-8"))
    files = [
        (next((f for f in (ROOT / "objstate" / p, ROOT / p) if f.is_file()), None), p, name)
        for p, name in named
    ]
    assert [path for file, path, _ in files if file is None] == []
    missing = [
        (path, name)
        for file, path, name in files
        if file is not None and name and not re.search(rf"\b{name}\b", file.read_text())
    ]
    assert missing == []
