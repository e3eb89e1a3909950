"""Settings: every constant of the estimator, with a default that serves without a file.

Fields are settings that a user may change. Class variables are constants of the method.

Parameters that Nav2's AMCL has carry its names and meanings. Files are checked strictly when they
are read; an unknown key is an error that names the nearest known one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import date, datetime, tzinfo
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)

from objstate.errors import SettingsError
from objstate.faults import faults
from objstate.geometry import checked_angle
from objstate.kinds import BUILDING, IMAGE, LOG, instead, kind_of
from objstate.units import SECONDS_PER_HOUR
from objstate.yaml_files import YamlError, read_yaml

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Angle = Annotated[float, Field(allow_inf_nan=False), AfterValidator(checked_angle)]  # rad
PositiveAngle = Annotated[Positive, AfterValidator(checked_angle)]  # rad
NonNegativeAngle = Annotated[NonNegative, AfterValidator(checked_angle)]  # rad
Share = Annotated[float, Field(ge=0, le=1)]
Probability = Annotated[float, Field(gt=0, le=1)]
Exponent = Annotated[float, Field(gt=0, le=1)]
ErrorM = Annotated[float, Field(gt=0, le=1)]  # m, a deviation of what was built or mounted
ErrorDeg = Annotated[float, Field(gt=0, le=90)]
Count = Annotated[int, Field(ge=1)]
Samples = Annotated[int, Field(ge=10)]  # fewer can't represent a deviation
ResolutionDeg = Annotated[float, Field(ge=0.01, le=30)]
ResolutionM = Annotated[float, Field(ge=0.0001, le=0.2)]


class Strict(BaseModel):
    """A group of settings: unknown keys are refused, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    def __init__(self, /, **data: Any) -> None:
        """Raises SettingsError with every fault, each with its place and cure."""
        try:
            super().__init__(**data)
        except ValidationError as error:
            told = "; ".join(faults(type(self), error, data))
            raise SettingsError(f"{type(self).__name__}: {told}") from error

    # groups within a file are then validated without ``__init__``, so that faults keep their places
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]


class BeamModelSettings(Strict):
    """p(d | d-hat), the likelihood of one measured range given the expected one.

    The four shares are normalized to one; names and meanings are AMCL's.
    """

    model: Literal["mixture", "gaussian"] = "mixture"  # gaussian: the paper's
    z_hit: NonNegative = 0.85
    z_short: NonNegative = 0.2
    z_max: NonNegative = 0.05
    z_rand: NonNegative = 0.15
    sigma_hit: Positive = 0.06  # m
    lambda_short: NonNegative = 0.5  # 1/m
    # mean number of neighbouring beams that one unexpected thing stops
    short_run: ClassVar[float] = 10.0
    short_std: ClassVar[float] = 0.1  # m by which their ranges differ from beam to beam

    @model_validator(mode="after")
    def _some_share(self) -> BeamModelSettings:
        if self.z_hit <= 0:
            raise ValueError("z_hit must be above 0: without it no range carries information")
        for key, readings in (("z_max", "missing returns"), ("z_rand", "some ranges")):
            if self.model == "mixture" and getattr(self, key) <= 0:
                raise ValueError(
                    f"{key} must be above 0: without it {readings} are impossible; give it a small "
                    "share, or set model: gaussian for the pure Gaussian"
                )
        return self


class ScanSettings(Strict):
    """Which scans and beams of dense or fast lasers are used."""

    least_gap_s: NonNegative = 0.08  # s; a scan of the same laser that follows sooner is skipped
    beam_spacing_deg: NonNegative = 1.0  # least angle between used beams; 0: all are used


class LocalizationSettings(Strict):
    """Monte Carlo localization."""

    min_particles: Count = 104  # whole vectors of eight
    max_particles: Count = 2000
    pf_err: ClassVar[float] = 0.05  # largest error between true and estimated distribution (KLD)
    # standard normal quantile of the probability of keeping pf_err; 2.33 is 0.99
    pf_z: ClassVar[float] = 2.33
    bin_xy: ClassVar[float] = 0.10  # m, cells of KLD sampling
    bin_yaw_deg: ClassVar[float] = 5.0
    resample_below: ClassVar[float] = (
        0.5  # share of samples; resample when the effective number falls below
    )
    least_effective: ClassVar[float] = (
        0.1  # share of samples that stays effective; the exponent is lowered for it
    )
    kernel_width: ClassVar[float] = (
        0.5  # width of the kernel of resampled copies; 1 is optimal for a Gaussian
    )
    alpha1: NonNegative = 0.02  # rotation noise from rotation
    alpha2: NonNegative = 0.02  # rotation noise from translation, rad^2 per m^2
    alpha3: NonNegative = 0.02  # translation noise from translation
    alpha4: NonNegative = 0.02  # translation noise from rotation, m^2 per rad^2
    update_min_d: ClassVar[float] = 0.25  # m; step length for which the alphas hold
    update_min_a: ClassVar[float] = 0.2  # rad; or turn
    max_beams: ClassVar[int] = 48  # of one scan, evenly spread
    tempering: ClassVar[float] = 0.1  # exponent on the likelihood of a scan
    initial_xy_std: ClassVar[float] = 0.3  # m, of a start pose given without a covariance
    initial_yaw_std_deg: ClassVar[float] = 10.0
    kidnaps_per_hour: Positive = 0.1  # rate at which the robot is carried elsewhere
    slips_per_hour: ClassVar[float] = (
        1.0  # rate at which it is displaced by about half a metre, unnoticed by odometry
    )
    # states of each uncertain object over which a beam is averaged
    object_states: ClassVar[int] = 5

    @model_validator(mode="after")
    def _ordered(self) -> LocalizationSettings:
        if self.min_particles > self.max_particles:
            raise ValueError(
                f"min_particles ({self.min_particles}) is above max_particles "
                f"({self.max_particles})"
            )
        return self


class OdometryErrorSettings(Strict):
    """How the log corrects the alphas."""

    wheel_slips_per_hour: ClassVar[float] = 30.0  # rate at which wheels begin to slip
    weight: ClassVar[float] = 1.0  # of the alphas, in stretches
    none_systematic: ClassVar[float] = 3.0  # weight of having no systematic error, in stretches
    stretch_m: ClassVar[float] = 1.0  # m of driving over which corrections are summed
    stretch_deg: ClassVar[float] = 60.0  # deg; or of turning
    least: ClassVar[float] = 0.05  # smallest factor on a variance
    most: ClassVar[float] = 4.0


class SearchSettings(Strict):
    """The search of the building for the robot."""

    spacing: ClassVar[float] = 0.25  # m between the free places that are tried
    max_places: ClassVar[int] = 20_000  # in larger buildings, places lie farther apart
    max_beams: ClassVar[int] = 40  # of one scan, for testing places
    looks: ClassVar[int] = 6  # number of keyframes of each laser
    min_d: ClassVar[float] = 0.4  # m driven between keyframes
    min_a: ClassVar[float] = 0.35  # rad; or turned
    every_s: ClassVar[float] = 1.0  # s between searches


class ObjectUpdateSettings(Strict):
    """When, and with which readings, the objects' beliefs are updated."""

    inference: Literal["joint", "marginal"] = "joint"  # marginal: the paper's
    max_distance: Positive = 3.5  # m from the robot (section 4.1 of the paper)
    robot_samples: ClassVar[int] = 20  # drawn from the robot belief for each update
    tempering: ClassVar[float] = 0.2  # exponent on the likelihood of a scan
    max_position_std: ClassVar[float] = 0.5  # m; with a wider robot belief no object is updated
    # how readings are shared out in marginal inference; frames: of the lasers that localize
    schedule: Literal["beams", "alternate"] | tuple[str, ...] = "beams"

    @field_validator("schedule", mode="before")
    @classmethod
    def _is_schedule(cls, given: Any) -> Any:
        if given in ("beams", "alternate") or (given and isinstance(given, list | tuple)):
            return given
        raise ValueError(
            f"{given!r} is no schedule; give beams, alternate, or the frames of the lasers that "
            "localize, such as [front]"
        )


class DoorErrorSettings(Strict):
    """Standard deviations of one door's static errors, where drives told of them."""

    hinge_std_m: ErrorM
    bearing_std_deg: ErrorDeg
    width_std_m: ErrorM | None = None  # of the leaf; else learnt from all doors
    # whether something stops the door at the limit farthest from closed; else none rests there
    stop_is_known: bool = True


class BuildingErrorSettings(Strict):
    """Prior standard deviations of errors of the building and of the lasers' mountings.

    They are updated by the log.
    """

    wall_std_m: ErrorM = 0.005  # offset of a piece of wall along its normal
    wall_length_m: ClassVar[float] = 5.0  # distance over which offsets of walls decorrelate
    hinge_std_m: ErrorM = 0.01  # of a hinge's place, in each direction
    bearing_std_deg: ErrorDeg = 0.2  # of the bearing of a closed leaf
    laser_std_m: ClassVar[float] = 0.005  # of a laser's place on the robot
    laser_yaw_std_deg: ErrorDeg = 0.3
    range_bias_std_m: ClassVar[float] = 0.005  # common offset of all ranges of a laser
    clock_std_s: ClassVar[float] = 0.02  # offset of a laser's stamps from the odometry's
    sweep_std_s: ClassVar[float] = 0.05  # duration of a sweep that the log doesn't tell
    range_std_m: ClassVar[float] = 0.03  # noise of a range
    robot_length_m: Positive = 0.5  # over which a single recorded belief's error decorrelates
    doors: dict[str, DoorErrorSettings] = {}  # by name, in place of hinge_std_m and bearing_std_deg


class GridSettings(Strict):
    """The occupancy grid of obstacles that are not in the building."""

    resolution_m: Annotated[float, Field(ge=0.01, le=1)] = 0.05  # side of a cell
    # time after which a cell is unknown again
    max_age_s: Annotated[float, Field(gt=0, le=1e9)] = 300.0
    reach_m: ClassVar[float] = 10.0  # m; weights of readings decrease with distance to zero here
    max_position_std: ClassVar[float] = (
        0.1  # m; the weight of scans decreases with the robot's deviation to zero here
    )


class Dynamics(Strict):
    """p(s | t, s'): an object stays, drifts a little, and is now and then moved."""

    moves_per_hour: NonNegative = 1.0
    drift_deg: NonNegative = 0.0  # standard deviation after one second, grows with sqrt(t)
    drift_m: NonNegative = 0.0

    @property
    def drift(self) -> tuple[float, float, float]:
        """m, m and rad, deviations of x, y and yaw after one second."""
        return _on_floor(self.drift_m, self.drift_deg)

    def moved(self, seconds: float) -> float:
        """Probability that an object is moved within some time."""
        return -math.expm1(-self.moves_per_hour * seconds / SECONDS_PER_HOUR)


class Rest(Strict):
    """Where a door comes to rest after a move."""

    closed: NonNegative = 0.3  # share that ends as the model shows it
    open: NonNegative = 0.2  # share that ends at the limit farthest from that

    @property
    def anywhere(self) -> float:
        """Share that ends anywhere between the limits."""
        return 1.0 - self.closed - self.open

    @model_validator(mode="after")
    def _some_between(self) -> Rest:
        if self.anywhere <= 0.0:
            raise ValueError(
                f"closed ({self.closed:g}) and open ({self.open:g}) must add up to less than 1; "
                "what is left of 1 ends between the limits"
            )
        return self


class Swing(Strict):
    """How a door moves while it is being moved."""

    seconds: ClassVar[float] = 2.0  # mean duration
    near_s: ClassVar[float] = 0.5  # mean time until it may be wherever doors come to rest
    most_deg_per_s: ClassVar[float] = 90.0  # hinged
    most_m_per_s: ClassVar[float] = 1.0  # sliding

    def most(self, is_hinged: bool) -> float:
        """rad/s or m/s."""
        return math.radians(self.most_deg_per_s) if is_hinged else self.most_m_per_s


class DoorSettings(Strict):
    """A hinged or sliding door: one degree of freedom between limits."""

    prior: Literal["uniform", "gaussian"] = "uniform"
    prior_mean_deg: float | None = None  # hinged; default: the modelled state
    prior_mean_m: float | None = None  # sliding
    prior_std_deg: Positive = 10.0
    prior_std_m: Positive = 0.1
    dynamics: Dynamics = Dynamics(moves_per_hour=2.0, drift_deg=0.05, drift_m=0.001)
    rest: Rest = Rest()
    swing: ClassVar[Swing] = Swing()
    resolution_deg: ResolutionDeg = 0.25  # spacing of the sampled angles
    resolution_m: ResolutionM = 0.005


class FurnitureSettings(Strict):
    """Something that stands on the floor: three degrees of freedom."""

    prior: Literal["gaussian", "uniform"] = "gaussian"
    prior_std_m: Positive = 0.2  # gaussian: deviation; uniform: half the width
    prior_std_deg: Positive = 15.0
    dynamics: Dynamics = Dynamics(moves_per_hour=1.0, drift_deg=0.1, drift_m=0.001)
    presence: Annotated[float, Field(gt=0, lt=1)] = 0.95  # probability that it is there
    motion: Literal["carried", "pushed"] = "carried"  # pushed: it may move while it is seen
    samples: Samples = 400  # in marginal inference
    nudge_m: Positive = 0.1  # deviation of small moves, which are as frequent as moves to the prior
    nudge_deg: Positive = 20.0

    @property
    def prior_std(self) -> tuple[float, float, float]:
        """m, m and rad; of a uniform prior, half the widths."""
        return _on_floor(self.prior_std_m, self.prior_std_deg)

    @property
    def nudge(self) -> tuple[float, float, float]:
        """m, m and rad, deviations of small moves."""
        return _on_floor(self.nudge_m, self.nudge_deg)


def _on_floor(metres: float, degrees: float) -> tuple[float, float, float]:
    """Deviations of x, y and yaw, in m and rad."""
    return metres, metres, math.radians(degrees)


ObjectSettings = DoorSettings | FurnitureSettings


CONSTANT = "now a constant of the method"
REPLACED_OF_OBJECTS = {  # keys of earlier versions, and what replaced them
    **dict.fromkeys(
        ("least_samples", "first_samples", "scouts", "scout_weight", "samples"),
        "furniture is represented by Gaussians",
    ),
    **dict.fromkeys(
        ("swing", "resolution_deg", "resolution_m", "nudge_m", "nudge_deg"), f"it is {CONSTANT}"
    ),
    "class": "an object's class follows from the type of its joint",
}
REPLACED_WITHIN = {  # the same of groups of an object's keys
    "dynamics": dict.fromkeys(("drift_deg", "drift_m"), f"it is {CONSTANT}"),
    "rest": {"anywhere": "it is what closed and open leave of 1"},
}


class ObjectRule(Strict):
    """Settings of the objects whose names match a pattern; later rules win."""

    match: str  # shell-style: * ? [..]
    prior: Literal["uniform", "gaussian"] | None = None
    prior_mean_deg: float | None = None
    prior_mean_m: float | None = None
    prior_std_deg: Positive | None = None
    prior_std_m: Positive | None = None
    dynamics: Dynamics | None = None
    rest: Rest | None = None
    presence: Annotated[float, Field(gt=0, lt=1)] | None = None
    motion: Literal["carried", "pushed"] | None = None

    @model_validator(mode="before")
    @classmethod
    def _none_replaced(cls, given: Any) -> Any:
        """Refuse keys of earlier versions, naming what replaced them."""
        if not isinstance(given, Mapping):
            return given
        replaced = {key: cure for key, cure in REPLACED_OF_OBJECTS.items() if given.get(key)}
        for group, cures in REPLACED_WITHIN.items():
            if isinstance(given.get(group), Mapping):
                replaced |= {key: cure for key, cure in cures.items() if key in given[group]}
        for key, cure in replaced.items():
            raise ValueError(f"'{key}' is no longer a setting: {cure}; remove it")
        return given


REPLACED: dict[tuple[str, ...], str] = {  # settings of earlier versions, and what replaced them
    ("map_error",): "building_error.wall_std_m is the prior deviation of walls",
    ("hinges",): "building_error.hinge_std_m is the prior deviation of hinges",
    (
        "object_updates",
        "joint_samples",
    ): "doors are inferred jointly once the pose is known to centimetres",
    ("consistency",): "errors shared by readings are learnt",
    (
        "object_updates",
        "localization_lasers",
    ): "give these frames as object_updates.schedule",
    (
        "object_updates",
        "correlation_m",
    ): "building_error.robot_length_m is the length over which the robot's error decorrelates",
    ("localization", "min_particles_by_furniture"): "furniture no longer needs robot samples",
}
REPLACED |= {
    (
        "localization",
        key,
    ): "being lost is a probability, with kidnaps_per_hour as the rate in its prior"
    for key in (
        "doubt_above",
        "doubt_margin",
        "doubt_after",
        "lost_below",
        "doubt_below",
        "fit_after",
        "usual_after",
    )
}
REPLACED |= {
    ("search", key): "places found by a search compete by their probability, with "
    "localization.kidnaps_per_hour in the prior"
    for key in ("sure", "confirmed", "track_odds")
}


CONSTANTS = {  # by group, settings of earlier versions
    "beam_model": ("short_std", "short_run"),
    "localization": (
        *("pf_err", "pf_z", "bin_xy", "bin_yaw_deg", "resample_below", "least_effective"),
        *("kernel_width", "update_min_d", "update_min_a", "max_beams", "tempering"),
        *("initial_xy_std", "initial_yaw_std_deg", "slips_per_hour", "object_states"),
    ),
    "odometry_error": (
        *("weight", "none_systematic", "stretch_m", "stretch_deg", "least", "most"),
        "wheel_slips_per_hour",
    ),
    "search": ("spacing", "max_places", "max_beams", "looks", "min_d", "min_a", "every_s"),
    "object_updates": ("robot_samples", "tempering", "max_position_std"),
    "building_error": (
        *("wall_length_m", "laser_std_m", "range_bias_std_m", "range_std_m", "clock_std_s"),
    ),
    "grid": ("reach_m", "max_position_std"),
}
REPLACED |= {(group, key): f"it is {CONSTANT}" for group, keys in CONSTANTS.items() for key in keys}


def _checked_day(given: Any) -> str:
    """A month and a day, such as 05-01."""
    try:
        if not isinstance(given, str):
            raise ValueError
        return f"{datetime.strptime(f'{LEAP_YEAR}-{given}', '%Y-%m-%d'):%m-%d}"
    except ValueError as error:
        raise ValueError(f"{given!r} is no day of a year; give MONTH-DAY, such as 05-01") from error


LEAP_YEAR = 2000  # which has all days that a year may have
DayOfYear = Annotated[str, BeforeValidator(_checked_day)]


class WarmSettings(Strict):
    """The warm season of each year; over new year where it ends before it begins."""

    begin: DayOfYear = Field(alias="from")
    to: DayOfYear  # which is included

    @property
    def days(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Month and day of its first and its last day."""
        first, last = (tuple(map(int, each.split("-"))) for each in (self.begin, self.to))
        return (first[0], first[1]), (last[0], last[1])

    @model_validator(mode="after")
    def _is_a_part(self) -> WarmSettings:
        first, last = (date(LEAP_YEAR, *day) for day in self.days)
        if (last - first).days in (365, -1):
            raise ValueError(
                f"from {self.begin} to {self.to} is the whole year; leave 'warm' out where "
                "there are no seasons"
            )
        return self


class CalendarSettings(Strict):
    """By which clock and seasons the people in the building live."""

    timezone: str = "UTC"  # such as Europe/Berlin
    holidays: tuple[date, ...] = ()  # days off beside weekends
    warm: WarmSettings | None = None  # None: no seasons are told apart

    @model_serializer(mode="wrap")
    def _without_none(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without seasons the words are those of versions that didn't have them."""
        words: dict[str, Any] = handler(self)
        return {key: value for key, value in words.items() if value is not None}

    @field_validator("timezone")
    @classmethod
    def _known(cls, given: str) -> str:
        try:
            ZoneInfo(given)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise ValueError(
                f"'{given}' is no time zone; give one such as Europe/Berlin"
            ) from error
        return given

    @property
    def zone(self) -> tzinfo:
        """The time zone."""
        return ZoneInfo(self.timezone)


class Settings(Strict):
    """All settings of one run."""

    scans: ScanSettings = ScanSettings()
    beam_model: BeamModelSettings = BeamModelSettings()
    localization: LocalizationSettings = LocalizationSettings()
    odometry_error: ClassVar[OdometryErrorSettings] = OdometryErrorSettings()
    search: ClassVar[SearchSettings] = SearchSettings()
    object_updates: ObjectUpdateSettings = ObjectUpdateSettings()
    building_error: BuildingErrorSettings = BuildingErrorSettings()
    grid: GridSettings = GridSettings()
    calendar: CalendarSettings = CalendarSettings()
    objects: tuple[ObjectRule, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _none_replaced(cls, given: Any) -> Any:
        """Refuse settings of earlier versions, naming what replaced them."""
        for path, cure in REPLACED.items():
            here = given
            for key in path:
                here = here.get(key) if isinstance(here, Mapping) else None
            if here is not None:
                raise ValueError(f"'{'.'.join(path)}' is no longer a setting: {cure}; remove it")
        return given

    def in_building(self, error: BuildingErrorSettings | None) -> Settings:
        """The settings with a building's errors, except those that were set explicitly."""
        if error is None:
            return self
        own = self.building_error
        explicit = {key: getattr(own, key) for key in own.model_fields_set}
        return self.model_copy(update={"building_error": error.model_copy(update=explicit)})

    def with_inference(self, inference: Literal["joint", "marginal"] | None) -> Settings:
        """The same settings with another form of inference, where one is given."""
        if inference is None:
            return self
        updates = self.object_updates.model_copy(update={"inference": inference})
        return self.model_copy(update={"object_updates": updates})

    def for_object(self, name: str, default_class: Literal["door", "furniture"]) -> ObjectSettings:
        """The settings of one object: its class's defaults under the rules that match its name.

        Raises SettingsError where a rule sets a key that the object's class doesn't have.
        """
        chosen: dict[str, Any] = {}
        for rule in self.objects:
            if fnmatchcase(name, rule.match):
                chosen |= rule.model_dump(by_alias=True, exclude_unset=True, exclude={"match"})
        model: type[ObjectSettings] = DoorSettings if default_class == "door" else FurnitureSettings
        if "dynamics" in chosen:
            chosen["dynamics"] = model().dynamics.model_dump() | chosen["dynamics"]
        own = parse_strict(model, chosen, f"settings of object '{name}'")
        error = self.building_error.doors.get(name)
        has_stop = "rest" in chosen or error is None or error.stop_is_known
        if has_stop or not isinstance(own, DoorSettings):
            return own
        return own.model_copy(update={"rest": own.rest.model_copy(update={"open": 0.0})})


Model = TypeVar("Model", bound=BaseModel)


def load_settings(path: str | Path | None) -> Settings:
    """Settings from a YAML file, or the defaults without one.

    Raises SettingsError naming the file, the key and the cure, TypeError for what is no path.
    """
    if path is None:
        return Settings()
    if not isinstance(path, str | Path):
        raise TypeError(
            f"A {type(path).__name__} is no path of settings; give that of a YAML file. A dict of "
            "settings becomes Settings by objstate.Settings.model_validate."
        )
    return parse_strict(Settings, load_yaml(Path(path)), str(path))


def check_settings(given: object) -> None:
    """Raise TypeError for what is no Settings, such as their path."""
    if not isinstance(given, Settings):
        raise TypeError(
            f"A {type(given).__name__} is no Settings; give those that objstate.load_settings reads "
            "from a YAML file."
        )


def load_yaml(path: Path) -> Any:
    """A YAML file's content; an empty file is an empty mapping. Raises SettingsError."""
    kind = kind_of(path)
    if kind in (BUILDING, IMAGE) or (kind or "").startswith(LOG):
        raise SettingsError(f"{path} is {kind}, not a YAML file; were two arguments exchanged?")
    try:
        content = read_yaml(path)
    except OSError as error:
        raise SettingsError(f"Can't read {path}: {error.strerror}; check the path.") from error
    except YamlError as error:
        raise SettingsError(f"{path} is not valid YAML: {error}; mend it there.") from error
    return {} if content is None else content


def parse_strict(model: type[Model], data: Any, where: str, kind: str = "settings") -> Model:
    """``data`` as a ``model``; SettingsError with every fault, each with its place and cure.

    ``where`` is the file, and ``kind`` what it should be, in words.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        told = instead(where, kind) or f"{where}: {'; '.join(faults(model, error, data))}"
        raise SettingsError(told) from error
