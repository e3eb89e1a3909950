"""What of a batch is still to be done, given what lies in its folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from objstate.batch.addresses import about_size_of, size_of
from objstate.batch.jobs import Context, Job
from objstate.batch.options import BatchOptions
from objstate.batch.request import Requested
from objstate.errors import LogError, OutageError, ResultError
from objstate.recording.batches import result_of
from objstate.recording.index import Entry, Making
from objstate.recording.mirror import Mirror
from objstate.run import BuildingInput, RunOptions

NAMES_SHOWN = 5  # settings that differ


@dataclass(frozen=True, eq=False)
class Leftover:
    """The jobs that are left, and why the other logs are none of them."""

    context: Context
    jobs: tuple[Job, ...]
    finished: tuple[str, ...]  # results that are there
    given_up: tuple[str, ...]  # failed before, and not to be tried again
    anew: tuple[str, ...]  # among the jobs: results that no longer hold


OnStart = Callable[[Leftover], None]


def plan(
    requested: Sequence[Requested],
    folder: Path,
    entries: Mapping[str, Entry],
    options: BatchOptions,
) -> Leftover:
    """What to run of ``requested``, into the batch ``folder``, given what its index knows.

    Raises ResultError for a result that was made otherwise than asked now, and
    BuildingError for a building that can't be read.
    """
    mirror = Mirror.of(folder)

    def out_of(name: str) -> str:
        return str(result_of(folder, name)) if mirror is None else mirror.address_of(name)

    addresses = sorted({each.log.building for each in requested})
    buildings = {address: BuildingInput.read(address) for address in addresses}
    context, numbers, texts = _context(requested, buildings)
    groups: dict[str, list[str]] = {"run": [], "finished": [], "given up": [], "anew": []}
    for each in requested:
        entry, asked = entries[each.log.name], texts[numbers[each.log.name]]
        building = buildings[each.log.building]
        groups[_state(each, asked, building, entry, folder, options)].append(each.log.name)
    wanted = {*groups["run"], *groups["anew"]}
    jobs = [
        Job(
            name=each.log.name,
            log=each.log.log,
            building=each.log.building,
            options=numbers[each.log.name],
            out=out_of(each.log.name),
            truth=each.log.truth,
            path=each.log.path,
        )
        for each in requested
        if each.log.name in wanted
    ]
    if len(jobs) > 1:  # the largest first, so that none of these is left for the end
        jobs.sort(key=lambda job: -about_size_of(job.log))
    return Leftover(
        context=context,
        jobs=tuple(jobs),
        finished=tuple(groups["finished"]),
        given_up=tuple(groups["given up"]),
        anew=tuple(groups["anew"]),
    )


def _context(
    requested: Sequence[Requested], buildings: Mapping[str, BuildingInput]
) -> tuple[Context, dict[str, int], list[str]]:
    """What the logs share; the number of each log's options in it, by name; options as JSON."""
    texts: dict[int, str] = {}  # by identity: most logs share one object
    number_of: dict[str, int] = {}
    chosen: dict[int, RunOptions] = {}
    numbers: dict[str, int] = {}
    for each in requested:
        text = texts.get(id(each.options))
        if text is None:
            text = texts[id(each.options)] = _canonical(each.options.to_dict())
        number = number_of.setdefault(text, len(number_of))
        chosen.setdefault(number, each.options)
        numbers[each.log.name] = number
    return Context(buildings, chosen), numbers, list(number_of)


def _state(
    each: Requested,
    asked: str,
    building: BuildingInput,
    entry: Entry,
    folder: Path,
    options: BatchOptions,
) -> str:
    status, made = entry.outcome.status, entry.making
    if status == "not run":
        return "run"
    if status != "done" or made is None:
        return "run" if options.retry_failed else "given up"
    differing = _differences(made, asked, building)
    if differing and not options.overwrite:
        raise ResultError(
            f"{folder} holds a result of '{each.log.name}' that was made otherwise ({differing}); "
            "choose another --out, or add --overwrite to make such results anew."
        )
    return "anew" if differing or _changed(each.log.log, made) else "finished"


def _differences(made: Making, asked: str, building: BuildingInput) -> str:
    """In words, what of a result's making differs from what is asked now; empty if nothing does."""
    places: list[str] = []
    if made.options != asked:
        places = sorted(_unlike(json.loads(made.options), json.loads(asked), ""))
    if made.geometry != building.description["geometry_sha256"]:
        places.insert(0, "building")
    return ", ".join([*places[:NAMES_SHOWN], *(["..."] if len(places) > NAMES_SHOWN else [])])


def _unlike(one: Any, other: Any, place: str) -> list[str]:
    """Where two values of JSON differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        return [
            inner
            for key in one.keys() | other.keys()
            for inner in _unlike(one.get(key), other.get(key), f"{place}.{key}".lstrip("."))
        ]
    return [] if one == other else [place]


def _changed(log: str, made: Making) -> bool:
    """Whether a log's size differs from that of a result's log; False if it is gone."""
    try:
        return size_of(log) != made.bytes
    except (LogError, OutageError):
        return False


def _canonical(options: Mapping[str, Any]) -> str:
    return json.dumps(options, sort_keys=True)
