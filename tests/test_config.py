"""Settings are checked where they come in, and errors name the cure."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import pytest

from objstate.config import (
    CalendarSettings,
    DoorSettings,
    FurnitureSettings,
    LocalizationSettings,
    Settings,
    Strict,
    load_settings,
    parse_strict,
)
from objstate.errors import SettingsError
from objstate.world.allowed import Task


def loaded(folder: Path, text: str) -> Settings:
    path = folder / "settings.yaml"
    path.write_text(text, encoding="utf-8")
    return load_settings(path)


def refused(folder: Path, text: str) -> str:
    with pytest.raises(SettingsError) as caught:
        loaded(folder, text)
    return str(caught.value)


@pytest.mark.parametrize("given", [{"scans": {}}, [], 5])
def test_what_is_no_path_of_settings_is_refused(given: Any) -> None:
    with pytest.raises(TypeError, match=r"is no path of settings; .*Settings.model_validate"):
        load_settings(given)


@pytest.mark.parametrize("text", ["", "# nothing but a remark\n", "{}", "objects: []"])
def test_an_empty_file_gives_the_defaults(tmp_path: Path, text: str) -> None:
    assert loaded(tmp_path, text) == load_settings(None) == Settings()
    assert load_settings(str(tmp_path / "settings.yaml")) == Settings()


@pytest.mark.parametrize(
    ("text", "place", "near"),
    [
        ("beam_modle: {}", "beam_modle", "beam_model"),
        ("beam_model: {zhit: 0.5}", "beam_model.zhit", "z_hit"),
        ("localization: {max_particle: 10}", "localization.max_particle", "max_particles"),
        ("objects: [{match: a, dynamics: {moves_per_hours: 1}}]", "dynamics", "moves_per_hour"),
        ("objects: [{match: a, presense: 1}]", "presense", "presence"),
    ],
)
def test_an_unknown_key_names_its_place_and_the_nearest_known(
    tmp_path: Path, text: str, place: str, near: str
) -> None:
    message = refused(tmp_path, text)
    assert place in message
    assert f"did you mean '{near}'?" in message
    assert "settings.yaml" in message


def test_a_key_like_no_other_lists_the_known(tmp_path: Path) -> None:
    message = refused(tmp_path, "beam_model: {qqqq: 1}")
    assert "known are" in message
    for key in ("z_hit", "sigma_hit", "lambda_short"):
        assert key in message


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("[1, 2]", "must be a group of keys"),
        ("localization: 3", "localization: must be a group of keys"),
        ("objects: {match: a}", "objects: must be a list"),
        ("objects: [{presence: 0.3}]", "objects[0].match: is required"),
    ],
)
def test_a_wrong_shape_is_told_in_words_of_yaml(tmp_path: Path, text: str, cure: str) -> None:
    assert cure in refused(tmp_path, text)


class Place(Strict):
    x: float
    y: float


class Thing(Strict):
    at: float | Place | Literal["home", "random"] = "home"


class Things(Strict):
    things: tuple[Thing, ...] = ()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"things": [{"at": {"x": 1}}]}, "file: things[0].at.y: is required"),
        ({"things": [{}, {"at": {"x": "a", "y": 2}}]}, "things[1].at.x: must be a number, not 'a'"),
        ({"things": [{"at": {"x": 1, "y": 2, "z": 3}}]}, "unknown key 'things[0].at.z'; known are"),
        (
            {"things": [{"at": "hmoe"}]},
            "things[0].at: must be a number or a group of keys or 'home' or 'random', not 'hmoe'",
        ),
        ({"things": 3}, "things: must be a list, as in '[first, second]'"),
    ],
)
def test_no_type_of_python_stands_in_a_message(data: Any, message: str) -> None:
    with pytest.raises(SettingsError) as told:
        parse_strict(Things, data, "file")
    assert message in str(told.value)
    assert ";" not in str(told.value).replace("; known", "")  # one fault


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    message = refused(tmp_path, "{beam_model: {sigma_hit: -1}, localization: {alpha9: 1}}")
    assert "beam_model.sigma_hit" in message
    assert "localization.alpha9" in message


@pytest.mark.parametrize(
    "text",
    [
        "beam_model: {sigma_hit: 0}",
        "beam_model: {sigma_hit: .inf}",
        "beam_model: {sigma_hit: .nan}",
        "beam_model: {z_rand: -0.1}",
        "beam_model: {z_hit: 0}",
        "beam_model: {model: likelihood_field}",
        "localization: {kidnaps_per_hour: 0}",
        "localization: {min_particles: 0}",
        "localization: {max_particles: 2.5}",
        "localization: {alpha1: many}",
        "object_updates: {max_distance: -3.5}",
        "object_updates: {schedule: sometimes}",
        "objects: [{match: a, prior_std_deg: 0}]",
        "objects: [{match: a, presence: 1}]",
        "objects: [{prior: uniform}]",
        "objects: {match: a}",
        "[1, 2]",
        "just text",
    ],
)
def test_values_out_of_range_or_of_another_kind_are_refused(tmp_path: Path, text: str) -> None:
    assert "settings.yaml: " in refused(tmp_path, text)


@pytest.mark.parametrize("key", ["z_max", "z_rand"])
def test_a_mixture_that_makes_readings_impossible_is_refused(tmp_path: Path, key: str) -> None:
    message = refused(tmp_path, f"beam_model: {{{key}: 0}}")
    assert f"{key} must be above 0" in message
    assert "model: gaussian" in message
    gaussian = loaded(tmp_path, f"beam_model: {{model: gaussian, {key}: 0}}")
    assert getattr(gaussian.beam_model, key) == 0.0


def test_more_particles_at_least_than_at_most_are_refused(tmp_path: Path) -> None:
    message = refused(tmp_path, "localization: {min_particles: 50, max_particles: 20}")
    assert "min_particles (50) is above max_particles (20)" in message


@pytest.mark.parametrize("content", [b"a: [1,", b"a: \xff\xfe", b"a: {b: c"])
def test_a_file_that_is_no_yaml_is_a_clear_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.yaml"
    path.write_bytes(content)
    with pytest.raises(SettingsError, match=r"broken\.yaml is not valid YAML"):
        load_settings(path)


def test_a_missing_file_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"nowhere\.yaml"):
        load_settings(tmp_path / "nowhere.yaml")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            {"localisation": {}},
            "Settings: unknown key 'localisation'; did you mean 'localization'?",
        ),
        (
            {"scans": {"least_gap_s": -1}, "grid": {"cell": 0.1}},
            r"Settings: scans\.least_gap_s: must be .* 0, not -1; unknown key 'grid\.cell'",
        ),
        (
            {"objects": [{"match": "*", "presence": 2}]},
            r"Settings: objects\[0\]\.presence: must be",
        ),
    ],
)
def test_in_python_faults_are_told_as_those_of_a_file(given: dict[str, Any], told: str) -> None:
    with pytest.raises(SettingsError, match=told):
        Settings(**given)


def test_a_group_alone_is_told_by_its_name() -> None:
    with pytest.raises(SettingsError, match="LocalizationSettings: min_particles: must be"):
        LocalizationSettings(min_particles=0)
    with pytest.raises(SettingsError, match=r"Task: default\.angle: must be"):
        Task(name="pass", default={"angle": -1.0})


def test_settings_never_change() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Settings().beam_model.z_hit = 0.1  # type: ignore[misc]


def test_rules_match_by_pattern_and_later_ones_win(tmp_path: Path) -> None:
    settings = loaded(
        tmp_path,
        """
        objects:
          - {match: "door_*", prior_std_deg: 5, rest: {closed: 0.7}}
          - {match: "door_0[12]", prior_std_deg: 7, prior: gaussian}
          - {match: "door_02", prior_mean_deg: 80}
        """,
    )
    first, second, third = (settings.for_object(f"door_0{k}", "door") for k in (1, 2, 3))
    other = settings.for_object("gate", "door")
    assert isinstance(first, DoorSettings)
    assert isinstance(second, DoorSettings)
    assert isinstance(third, DoorSettings)
    assert (first.prior_std_deg, first.rest.closed, first.prior) == (7, 0.7, "gaussian")
    assert (second.prior_mean_deg, first.prior_mean_deg) == (80, None)
    assert (third.prior_std_deg, third.prior) == (5, "uniform")
    assert other == DoorSettings()


def test_a_door_of_which_no_stop_is_known_rests_at_none(tmp_path: Path) -> None:
    told = "building_error: {doors: {d: {hinge_std_m: 0.01, bearing_std_deg: 1, %s}}}"
    known = loaded(tmp_path, told % "stop_is_known: true").for_object("d", "door")
    unknown = loaded(tmp_path, told % "stop_is_known: false").for_object("d", "door")
    given = loaded(
        tmp_path, told % "stop_is_known: false" + "\nobjects: [{match: d, rest: {open: 0.4}}]"
    ).for_object("d", "door")
    assert isinstance(known, DoorSettings)
    assert isinstance(unknown, DoorSettings)
    assert isinstance(given, DoorSettings)
    assert (known.rest.open, unknown.rest.open, given.rest.open) == (0.2, 0.0, 0.4)
    assert unknown.rest.closed == known.rest.closed


def test_patterns_tell_capitals_apart(tmp_path: Path) -> None:
    settings = loaded(tmp_path, "objects: [{match: 'Door*', prior_std_deg: 2}]")
    assert settings.for_object("door_01", "door") == DoorSettings()


def test_what_a_rule_leaves_out_stays_as_an_earlier_one_set_it(tmp_path: Path) -> None:
    rules = "objects: [{match: '*', dynamics: {moves_per_hour: 3}}, {match: a, prior_std_deg: 1}]"
    door = loaded(tmp_path, rules).for_object("a", "door")
    assert isinstance(door, DoorSettings)
    assert (door.dynamics.moves_per_hour, door.prior_std_deg) == (3, 1)
    assert door.dynamics.drift_deg == DoorSettings().dynamics.drift_deg


def test_furniture_has_furniture_settings(tmp_path: Path) -> None:
    desk = loaded(tmp_path, "objects: [{match: desk, presence: 0.9}]").for_object(
        "desk", "furniture"
    )
    assert isinstance(desk, FurnitureSettings)
    assert (desk.presence, desk.prior) == (0.9, "gaussian")


def test_a_rule_that_sets_what_the_class_has_not_is_an_error(tmp_path: Path) -> None:
    settings = loaded(tmp_path, "objects: [{match: desk, rest: {closed: 0.5}}]")
    with pytest.raises(SettingsError, match=r"object 'desk'.*rest"):
        settings.for_object("desk", "furniture")


def test_another_inference_changes_nothing_else() -> None:
    told = Settings.model_validate({"object_updates": {"max_distance": 2.5}})
    marginal = told.with_inference("marginal")
    assert marginal.object_updates.inference == "marginal"
    assert marginal.object_updates.max_distance == 2.5
    assert told.with_inference(None) is told
    assert marginal.with_inference("joint") == told


@pytest.mark.parametrize(
    ("given", "cure"),
    [
        ({"hinges": {"in_place": 1.0}}, "building_error.hinge_std_m"),
        ({"map_error": {"std_m": 0.01}}, "building_error.wall_std_m"),
        ({"consistency": {"stretch": 0.3}}, "are learnt"),
        ({"object_updates": {"localization_lasers": ["a"]}}, "as object_updates.schedule"),
        ({"objects": [{"match": "d", "rest": {"anywhere": 1}}]}, "closed and open leave"),
        ({"beam_model": {"short_run": 1}}, "'beam_model.short_run' .* constant"),
        ({"object_updates": {"correlation_m": 0.1}}, "building_error.robot_length_m"),
        ({"localization": {"min_particles_by_furniture": 9}}, "no longer needs robot samples"),
        ({"objects": [{"match": "desk", "scouts": 80}]}, "represented by Gaussians"),
        ({"objects": [{"match": "d", "class": "door"}]}, "the type of its joint"),
        ({"objects": [{"match": "d", "dynamics": {"drift_deg": 1}}]}, "'drift_deg' .* constant"),
        ({"localization": {"tempering": 0.2}}, "'localization.tempering' .* constant"),
        ({"search": {"spacing": 0.2}}, "'search.spacing' .* constant"),
    ],
)
def test_a_setting_that_was_replaced_is_an_error_that_says_by_what(
    given: dict[str, object], cure: str
) -> None:
    with pytest.raises(SettingsError, match=cure):
        parse_strict(Settings, given, "old.yaml")


def test_a_deviation_in_millimetres_is_refused(tmp_path: Path) -> None:
    message = refused(tmp_path, "building_error: {hinge_std_m: 30}")
    assert "building_error.hinge_std_m: must be less than or equal to 1, not 30" in message


@pytest.mark.parametrize("key", ["lost_below", "doubt_above", "fit_after"])
def test_thresholds_of_being_lost_are_replaced_by_rates(tmp_path: Path, key: str) -> None:
    message = refused(tmp_path, f"{{localization: {{{key}: 0.5}}}}")
    assert f"'localization.{key}' is no longer a setting" in message
    assert "kidnaps_per_hour" in message
    assert "kidnaps_per_hour" in refused(tmp_path, "{search: {track_odds: 10}}")


@pytest.mark.parametrize(
    ("text", "days"),
    [
        ("{from: 05-01, to: 09-30}", ((5, 1), (9, 30))),
        ("{from: 11-01, to: 03-31}", ((11, 1), (3, 31))),
        ("{from: '5-1', to: '9-30'}", ((5, 1), (9, 30))),
        ("{from: 02-29, to: 06-30}", ((2, 29), (6, 30))),
    ],
)
def test_the_warm_season_is_from_a_day_to_a_day(tmp_path: Path, text: str, days: object) -> None:
    calendar = loaded(tmp_path, f"calendar: {{warm: {text}}}").calendar
    assert calendar.warm is not None
    assert calendar.warm.days == days
    for by_alias in (False, True):
        again = CalendarSettings.model_validate_json(calendar.model_dump_json(by_alias=by_alias))
        assert again == calendar


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{from: 05-01, to: 09-31}", "'09-31' is no day of a year; give MONTH-DAY"),
        ("{from: May, to: 09-30}", "'May' is no day of a year"),
        ("{from: 2026-05-01, to: 09-30}", "is no day of a year"),
        ("{from: 5, to: 09-30}", "5 is no day of a year"),
        ("{from: 05-01}", "calendar.warm.to"),
        ("{from: 05-01, to: 04-30}", "is the whole year"),
        ("{from: 01-01, to: 12-31}", "is the whole year"),
        ("{from: 05-01, till: 09-30}", "till"),
    ],
)
def test_a_warm_season_that_is_none_is_refused(tmp_path: Path, text: str, told: str) -> None:
    message = refused(tmp_path, f"calendar: {{warm: {text}}}")
    assert told in message
    assert "calendar.warm" in message


def test_a_calendar_without_seasons_has_no_word_of_them() -> None:
    assert CalendarSettings().model_dump_json() == '{"timezone":"UTC","holidays":[]}'
