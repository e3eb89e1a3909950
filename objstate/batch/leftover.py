"""What of a batch is still to be done, given what lies in its folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from objstate.batch.addresses import size_of
from objstate.batch.jobs import Context, Job
from objstate.batch.options import BatchOptions
from objstate.batch.request import Requested
from objstate.errors import LogError, OutageError, ResultError
from objstate.recording.batches import read_outcome, result_of
from objstate.recording.summary import read_summary
from objstate.run import BuildingInput

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


def plan(requested: Sequence[Requested], folder: Path, options: BatchOptions) -> Leftover:
    """What to run of ``requested``, into the batch ``folder``.

    Raises ResultError for a result that was made otherwise than asked now, and
    BuildingError for a building that can't be read.
    """
    addresses = sorted({each.log.building for each in requested})
    buildings = {address: BuildingInput.read(address) for address in addresses}
    context, numbers = _context(requested, buildings)
    groups: dict[str, list[str]] = {"run": [], "finished": [], "given up": [], "anew": []}
    for each in requested:
        groups[_state(each, buildings[each.log.building], folder, options)].append(each.log.name)
    wanted = {*groups["run"], *groups["anew"]}
    return Leftover(
        context=context,
        jobs=tuple(
            Job(
                name=each.log.name,
                log=each.log.log,
                building=each.log.building,
                options=numbers[each.log.name],
                out=str(result_of(folder, each.log.name)),
            )
            for each in requested
            if each.log.name in wanted
        ),
        finished=tuple(groups["finished"]),
        given_up=tuple(groups["given up"]),
        anew=tuple(groups["anew"]),
    )


def _context(
    requested: Sequence[Requested], buildings: Mapping[str, BuildingInput]
) -> tuple[Context, dict[str, int]]:
    """What the logs share, and the number of each log's options in it, by name."""
    texts = {each.log.name: _canonical(each.options.to_dict()) for each in requested}
    by_text = {texts[each.log.name]: each.options for each in requested}
    number_of = {text: number for number, text in enumerate(by_text)}
    context = Context(buildings, dict(enumerate(by_text.values())))
    return context, {name: number_of[text] for name, text in texts.items()}


def _state(each: Requested, building: BuildingInput, folder: Path, options: BatchOptions) -> str:
    name = each.log.name
    outcome = read_outcome(folder, name)
    if outcome.status == "not run":
        return "run"
    if outcome.status != "done":
        return "run" if options.retry_failed else "given up"
    made = read_summary(result_of(folder, name))
    differing = _differences(made, each, building)
    if differing and not options.overwrite:
        raise ResultError(
            f"{folder} holds a result of '{name}' that was made otherwise ({differing}); choose "
            "another --out, or add --overwrite to make such results anew."
        )
    return "anew" if differing or _changed(each.log.log, made) else "finished"


def _differences(made: Mapping[str, Any], each: Requested, building: BuildingInput) -> str:
    """In words, what of a result's making differs from what is asked now; empty if nothing does."""
    asked = json.loads(_canonical(each.options.to_dict()))
    places = sorted(_unlike(made.get("options"), asked, ""))
    geometry = made.get("inputs", {}).get("building", {}).get("geometry_sha256")
    if geometry != building.description["geometry_sha256"]:
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


def _changed(log: str, made: Mapping[str, Any]) -> bool:
    """Whether a log has another size than the one that a result was made of; False if it is gone."""
    try:
        return size_of(log) != sum(int(file["bytes"]) for file in made["inputs"]["logs"])
    except (LogError, OutageError):
        return False


def _canonical(options: Mapping[str, Any]) -> str:
    return json.dumps(options, sort_keys=True)
