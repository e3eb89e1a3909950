"""Failures and warnings of a run."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from fnmatch import fnmatchcase

from objstate.building.model import Building, Kind
from objstate.building.sidecar import sidecar_path, unknown_doors
from objstate.estimator import Estimator
from objstate.frame_names import frame_name
from objstate.logs.scans import without_return
from objstate.run.drive import THROUGH, Drive
from objstate.run.options import RunOptions
from objstate.run.start import start_outside

COMPASS = (  # counter-clockwise
    "east",
    "north-east",
    "north",
    "north-west",
    "west",
    "south-west",
    "south",
    "south-east",
)
# share of a log; a robot that is lost for longer is in another building, or started elsewhere
MOST_LOST = 0.5
NOTICEABLY_LOST = 0.005  # share of a log, which rounds to a percent
LONG_PAUSE_NS = 600 * 1_000_000_000  # ns without a record, after which a drive may be another
# ns in which a recorded robot belief is too wide for objects near it, by which a door is missed
LONG_WIDE_NS = 5 * 1_000_000_000
SHORT_WIDE_NS = 50_000_000  # ns; less is one scan, and reads 0.0 s
NAMES_SHOWN = 5  # most names in a list
# share of readings that pass through walls; in the buildings of real logs it was 0 to 0.13
MOST_THROUGH = 0.15


def failures(drive: Drive, estimator: Estimator, options: RunOptions) -> list[str]:
    """Why a run's estimates aren't reliable; empty for a success."""
    found = []
    if drive.seconds <= 0.0:
        found.append(
            f"The log has no duration: all that is read of it ({_scans(drive.scans)}) has one "
            "stamp, and one moment can't be localized. Give a log of some seconds, or a longer "
            "part of it."
        )
    if _was_never_found(estimator, options):
        found.append(
            "The robot, whose start was unknown, was not found: several places explain its scans "
            "about equally, or none does. Nothing was learnt of objects. Is it a log of this "
            "building? Then give --initial-pose, or a drive that passes distinct places."
        )
    elif (share := lost_share(drive, estimator, options)) > MOST_LOST:
        found.append(
            f"The robot was probably lost for {100 * share:.0f} % of the log: is it a log of this "
            "building, and is its start right?"
        )
    return found


def lost_share(drive: Drive, estimator: Estimator, options: RunOptions) -> float:
    """Share of the log, 0..1, in which the robot was lost, without an initial search."""
    if drive.seconds <= 0.0:
        return 0.0
    lost_ns = sum(found - since for since, found in _stretches(estimator, options))
    return min(lost_ns / 1e9 / drive.seconds, 1.0)


def doubts(drive: Drive, estimator: Estimator, options: RunOptions) -> list[str]:
    """Warnings, each with the likely cause and where to look."""
    building = estimator.building
    return [
        *_of_rules(building, options),
        *_of_lasers(drive, building, options),
        *_of_path(drive, estimator, options),
        *_of_pauses(drive),
        *_of_being_lost(drive, estimator, options),
        *_of_width(drive, estimator),
        *_of_objects(drive, estimator, options),
        *_of_unmet(estimator),
        *_of_hinges(estimator),
    ]


def doubts_of_robot(drive: Drive, estimator: Estimator, options: RunOptions) -> list[str]:
    """Warnings of where the robot was, for those who learn from a drive."""
    found = list(_of_path(drive, estimator, options))
    if (share := lost_share(drive, estimator, options)) > NOTICEABLY_LOST:
        found.append(
            f"The robot was probably lost for {100 * share:.0f} % of the log, of which nothing is "
            "learnt of objects."
        )
    return found


def _of_rules(building: Building, options: RunOptions) -> Iterator[str]:
    for rule in options.settings.objects:
        if not any(fnmatchcase(name, rule.match) for name in building.objects):
            yield (
                f"The settings' rule for '{rule.match}' matches no object; the building has "
                f"{_some(building.objects)}."
            )
    yield from unknown_doors(options.settings.building_error, building.objects, "the settings")
    if building.error is not None and building.source is not None:
        yield from unknown_doors(building.error, building.objects, sidecar_path(building.source))


def _of_pauses(drive: Drive) -> Iterator[str]:
    length_ns, since_ns = drive.pause_ns
    if length_ns > LONG_PAUSE_NS:
        yield (
            f"The log has nothing for {length_ns / 1e9:.0f} s from {_at(since_ns, drive):.0f} s on, "
            "and objects may have been moved meanwhile. If these are two drives, or a clock was "
            "set, estimate each part by itself."
        )


def _of_lasers(drive: Drive, building: Building, options: RunOptions) -> Iterator[str]:
    named = [("--mount", frame) for frame in options.mounts]
    named += [("--clock-offset", frame) for frame in options.clock_offsets]
    for option, frame in named:
        if frame_name(frame) not in drive.heights:
            yield (
                f"{option} names '{frame}', but no scan of it was read; there are scans of "
                f"{_some(drive.heights)}."
            )
    for frame, tilt in drive.tilts.items():
        yield (
            f"The laser '{frame}' looks up or down by {math.degrees(tilt):.0f}°. Objects are "
            "updated by its scans as in the paper, without the errors of robot and building: slower "
            "and less exactly. Where another laser is level, leave this one out (--topics)."
        )
    for frame, limits in drive.without_return.items():
        yield without_return(frame, *limits)
    if not len(building.walls.vertices):
        return
    heights = building.walls.vertices[:, 2]
    floor, top = float(heights.min()), float(heights.max())
    for frame, height in drive.heights.items():
        if not floor < height < top:
            yield (
                f"The laser '{frame}' is mounted at a height of {height:g} m, where it meets no "
                f"wall: they reach from {floor:.2f} to {top:.2f} m. Give its height with --mount."
            )


def _of_path(drive: Drive, estimator: Estimator, options: RunOptions) -> Iterator[str]:
    outside = start_outside(drive.start, estimator.building)
    if outside is not None:
        yield outside
    if estimator.scans_without_pose:
        yield (
            f"{estimator.scans_without_pose} of {drive.scans} scans were left out: they come "
            "before the robot's pose is known."
        )
    unlocalized = options.belief == "own" and estimator.corrections == 0
    if unlocalized and not _was_never_found(estimator, options):
        yield (
            "No scan localized the robot; its path is dead reckoning. Does "
            "object_updates.schedule name the log's lasers?"
        )
    if drive.share_through > MOST_THROUGH:
        yield (
            f"{100 * drive.share_through:.0f} % of the readings pass through walls of the building "
            f"by more than {THROUGH:g} m, as seen from the estimated poses. Glass alone allows "
            "that. Is it a log of this building, are the walls where the model has them, and is the "
            "laser mounted as the log says?"
        )
    if options.belief == "own" and not len(estimator.building.walls.faces):
        yield "The building has no walls to localize by; give its root link some."


def _was_never_found(estimator: Estimator, options: RunOptions) -> bool:
    return options.global_start and estimator.is_lost and len(estimator.lost) == 1


def _stretches(estimator: Estimator, options: RunOptions) -> Sequence[tuple[int, int]]:
    """Intervals of being lost, without an initial search."""
    searched = options.global_start and not _was_never_found(estimator, options)
    return tuple(estimator.lost)[searched:]


def _of_being_lost(drive: Drive, estimator: Estimator, options: RunOptions) -> Iterator[str]:
    if _was_never_found(estimator, options):
        return  # reported as a failure
    stretches = _stretches(estimator, options)
    searching = len(estimator.lost) - len(stretches)
    for _, found in tuple(estimator.lost)[:searching]:
        yield (
            f"The robot, whose start was unknown, was found {_at(found, drive):.0f} s from the "
            "log's start. Earlier scans were not used for objects."
        )
    probabilities = estimator.lost_probabilities[searching:]
    times = [
        f"{_at(since, drive):.1f} s to {_at(until, drive):.1f} s (p = {probability:.2f})"
        for (since, until), probability in zip(stretches, probabilities, strict=True)
    ]
    if len(times) > 1:
        seconds = sum(until - since for since, until in stretches) / 1e9
        times = [f"{_some(times)} ({len(times)} times, {seconds:.0f} s)"]
    for each in times:
        yield (
            f"The robot was probably lost from {each} of the log: its scans were more probable "
            "from another place, or from one that isn't on the map. Estimates of this time are "
            "marked in the column 'lost', and what was learnt of objects then was discarded."
        )
    if estimator.is_lost and stretches:
        yield (
            f"At the log's end the robot is still probably lost (p = {probabilities[-1]:.2f}). "
            f"Nothing was learnt of objects since {_at(stretches[-1][0], drive):.1f} s."
        )


def _at(stamp_ns: int, drive: Drive) -> float:
    """Seconds from the log's start."""
    return (stamp_ns - drive.begin_ns) / 1e9


def _of_objects(drive: Drive, estimator: Estimator, options: RunOptions) -> Iterator[str]:
    if not estimator.building.objects:
        yield "The building has no movable objects; only the robot's path was estimated."
    elif _was_never_found(estimator, options):
        return
    elif drive.without_return.keys() == drive.heights.keys() != set():
        return  # reported of each laser
    elif not drive.estimates and estimator.too_wide.first_ns is None:
        yield "No scan was near an object. Is this the building of the log, and the start right?"
    elif drive.estimates and not drive.observed:
        yield (
            "The robot passed objects, but no beam reached any of them; their states are their "
            "priors. Do the lasers see them at their height?"
        )


def _of_width(drive: Drive, estimator: Estimator) -> Iterator[str]:
    """Warn of a recorded robot belief that was too wide for objects, for long or all the time."""
    wide = estimator.too_wide
    if wide.first_ns is None or (drive.estimates and wide.total_ns < LONG_WIDE_NS):
        return
    first, last = (f"{_at(stamp_ns, drive):.1f}" for stamp_ns in (wide.first_ns, wide.last_ns))
    when = f"at {first} s of the log"
    if wide.total_ns >= SHORT_WIDE_NS:
        when = f"in {wide.total_ns / 1e9:.1f} s of the log, between {first} and {last} s"
    had, most = f"{wide.position_std:.2f} m", f"{wide.limit.position_std:g} m"
    if math.isfinite(wide.limit.yaw_std):
        had += f" and {math.degrees(wide.yaw_std):.1f}°"
        most += f" and {math.degrees(wide.limit.yaw_std):.1f}°"
    yield (
        f"No object was updated {when}, although some were near: the recorded robot belief had "
        f"standard deviations of up to {had}, and objects need {most} at most. --belief own "
        "localizes by the scans."
    )


def _of_unmet(estimator: Estimator) -> Iterator[str]:
    """Warn of doors whose leaves no beam met where they could be."""
    unmet = {
        name: belief.presence
        for name, belief in estimator.objects.items()
        if belief.item.kind is not Kind.PLANAR and belief.presence < 0.5
    }
    if unmet:
        least = 1.0 - max(unmet.values())
        yield (
            f"No beam met the leaf of {_some(unmet)} where it could be (p = {least:.2f}): it was "
            "taken out, it is modelled wrongly, or the laser looks under it, above it or through "
            "it. Its state isn't known from this log, and its interval says so."
        )


def _of_hinges(estimator: Estimator) -> Iterator[str]:
    stated = estimator.settings.building_error.hinge_std_m
    places = {
        f"'{name}'": f"{math.hypot(x, y):.2f} m {compass(x, y)} of its place in the model "
        f"(x {x:+.2f} m, y {y:+.2f} m)"
        for name, (x, y) in estimator.hung_elsewhere.items()
    }
    cure = (
        " What stands in a doorway, or a leaf of another form, can look like that: see the report, "
        "and let several drives tell (objstate building learn LOG... --building URDF). If hinges were "
        f"placed less exactly than {stated:g} m, state it (building_error.hinge_std_m)."
    )
    if len(places) == 1:
        ((door, place),) = places.items()
        yield (
            f"The hinge of door {door} seems to be {place}; its angle refers to a leaf there."
            + cure
        )
    elif places:
        told = "; ".join(f"{door} {place}" for door, place in places.items())
        yield (
            f"The hinges of {len(places)} doors seem to be elsewhere: {told}. Their angles refer to "
            "leaves there." + cure
        )


def compass(x: float, y: float) -> str:
    """The compass direction of (x, y), in a frame whose x axis points east (REP-103)."""
    return COMPASS[round(math.atan2(y, x) / (math.pi / 4.0)) % len(COMPASS)]


def _scans(count: int) -> str:
    return "1 scan" if count == 1 else f"{count} scans"


def _some(names: Collection[str]) -> str:
    shown = list(names)[:NAMES_SHOWN]
    return ", ".join([*shown, "..."] if len(names) > NAMES_SHOWN else shown) or "none"
