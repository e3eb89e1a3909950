"""Both clients against a service in a process of its own: what is asked, sent, refused and resumed."""

from __future__ import annotations

import asyncio
import stat
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from functools import partial
from math import radians
from pathlib import Path

import pytest

from objstate.client import AsyncClient, Client, Event
from objstate.errors import LogError, OutageError, ServiceError, SettingsError
from objstate.world.store import open_store
from tests.client.conftest import ANGLE, DOOR, Service, start, teach

SECOND = 10**9


@pytest.fixture
def client(service: Service) -> Client:
    return Client(service.url, service.token_file)


def test_the_token_file_is_for_its_owner_alone(service: Service) -> None:
    assert stat.S_IMODE(service.token_file.stat().st_mode) == 0o600
    assert service.token_file.read_text().strip().encode() not in service.world.read_bytes()


def test_answers_are_those_of_the_world(client: Client, service: Service) -> None:
    world = open_store(service.world).load()
    at = world.latest_ns or 0
    belief = world.at(at)[DOOR]
    told = client.object(DOOR, at, samples=True)
    assert told.state["angle"].mean == pytest.approx(ANGLE, abs=0.01)
    assert told.weights == pytest.approx(belief.weights.values.tolist())
    assert not told.predicted
    assert client.objects(at)[DOOR].state == told.state
    assert {each.object for each in client.objects().objects} == set(world.objects)
    for width, length in ((0.1, 0.0), (0.15, 0.9), (0.6, 0.9)):
        passage = client.passage(DOOR, width, length, at)
        assert passage.probability == pytest.approx(belief.probability_clear(width, length))
    assert [each.stamp_ns for each in client.history(DOOR).history] == [at]


def test_a_belief_fades_with_the_time_of_arrival(client: Client) -> None:
    now = client.objects().at_ns
    soon, late = (client.passage(DOOR, 0.6, at=now + s * SECOND) for s in (1, 36_000))
    assert soon.probability < late.probability
    assert soon.clear_width.upper < late.clear_width.upper


def test_moments_are_nanoseconds_or_times_with_a_zone(client: Client) -> None:
    east = datetime.now(UTC).astimezone(datetime.now().astimezone().tzinfo)
    told = client.object(DOOR, east)
    assert (
        told.at_ns == (east - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000
    )
    with pytest.raises(SettingsError, match="has no zone"):
        client.object(DOOR, datetime(2026, 1, 1))


def test_what_planners_ask(client: Client) -> None:
    now = client.objects().at_ns
    door = client.object(DOOR, now)
    x, y = door.footprint[0] if door.footprint else (12.5, 0.7)
    through = [(x, -0.5), (x, 2.0 * y)]
    asked = client.blocked(through, 0.3, now)
    assert 0.0 <= asked.probability <= 1.0
    same = client.blocked(through, 0.3, arrivals=[now, now])
    assert same.probability == pytest.approx(asked.probability)
    edges = client.edges({7: through}, 0.3, detour_cost=10.0, close_from=1.0, at=now)
    assert edges.adjust_edges[0].edgeid == 7
    assert edges.adjust_edges[0].cost == pytest.approx(10.0 * asked.probability)
    assert client.doors(0.6, at=now).doors[DOOR].name == "CLOSED"


@pytest.mark.parametrize(
    ("ask", "status"),
    [
        (lambda c: c.object("no door"), 404),
        (lambda c: c.object("../../etc/passwd"), 404),
        (lambda c: c.drive("0000"), 404),
        (lambda c: c.passage(DOOR, -1.0), 422),
        (lambda c: c.blocked([(0.0, 0.0)], 0.3), 422),
        (lambda c: c.blocked([(0.0, 0.0), (1.0, 0.0)], 0.3, arrivals=[2, 1]), 422),
        (lambda c: c.report(DOOR, "sensor", "ajar"), 422),
    ],
)
def test_refusals_say_what_and_the_cure(client: Client, ask: object, status: int) -> None:
    assert callable(ask)
    with pytest.raises(ServiceError) as caught:
        ask(client)
    assert caught.value.status == status
    assert caught.value.detail
    assert caught.value.cure
    assert caught.value.detail in str(caught.value)


def test_a_damaged_log_fails_alone_and_with_its_reason(client: Client, tmp_path: Path) -> None:
    damaged = tmp_path / "cut.mcap"
    damaged.write_bytes(b"\x89MCAP0\r\n" + b"\x00" * 50)
    sent = client.send(damaged)
    assert client.send(damaged).id == sent.id
    ended = client.wait(sent.id, timeout_s=60.0)
    assert ended.state == "failed"
    assert ended.reason
    assert sum(each.id == sent.id for each in client.drives()) == 1
    client.delete_drive(sent.id)
    with pytest.raises(ServiceError, match="no drive"):
        client.drive(sent.id)


def test_a_folder_is_sent_as_one_bag(client: Client, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "part_0.mcap").write_bytes(b"\x89MCAP0\r\n")
    first = client.send(bag)
    assert client.send(bag).id == first.id
    assert "metadata.yaml" in (client.wait(first.id, timeout_s=60.0).reason or "")
    with pytest.raises(LogError, match="no log at"):
        client.send(tmp_path / "missing.mcap")


def test_both_clients_answer_alike(service: Service, client: Client) -> None:
    at = client.objects().at_ns

    async def ask() -> list[object]:
        async with AsyncClient(service.url, service.token_file) as asking:
            found = await asyncio.gather(
                asking.object(DOOR, at),
                asking.passage(DOOR, 0.6, 0.9, at),
                asking.doors(0.6, at=at),
            )
            return list(found)

    for _ in range(20):  # until no drive that was sent before is added in between
        before = client.object(DOOR, at)
        alike = [before, client.passage(DOOR, 0.6, 0.9, at), client.doors(0.6, at=at)]
        answers = asyncio.run(ask())
        if client.object(DOOR, at).revision == before.revision:
            break
    assert answers == alike


def test_who_may_not_is_told(service: Service) -> None:
    with pytest.raises(ServiceError) as caught:
        Client(service.url, "objstate_guessed").objects()
    assert caught.value.status == 401
    with pytest.raises(SettingsError, match="no address"):
        Client("127.0.0.1:8000", "x")
    with pytest.raises(SettingsError, match="token can't be read"):
        Client(service.url, Path("/nowhere/token"))


def test_evidence_and_the_stream_outlast_a_power_cut(tmp_path: Path) -> None:
    teach(tmp_path)
    service = start(tmp_path)
    client, heard = Client(service.url, service.token_file), list[Event]()
    both_came = threading.Event()

    def listen() -> None:
        for event in client.stream("0"):
            if event.kind == "belief":
                heard.append(event)
            if len(heard) == 2:
                both_came.set()
                return

    threading.Thread(target=listen, daemon=True).start()
    reported = client.report(DOOR, "contact sensor", "open", reliability=0.999)
    service.kill()
    with pytest.raises(OutageError, match="doesn't answer"):
        client.objects()
    service = start(tmp_path, port=int(service.url.rpartition(":")[2]))
    kept = client.object(DOOR, reported.stamp_ns).state["angle"]  # in single precision
    assert kept.mean == pytest.approx(reported.state["angle"].mean, abs=1e-6)
    client.report(DOOR, "contact sensor", "closed", reliability=0.999)
    assert both_came.wait(30.0)
    service.kill()
    numbers = [int(event.id) for event in heard]
    assert numbers == sorted(set(numbers))
    assert heard[0].data["stamp_ns"] == reported.stamp_ns


def test_reports_at_once_all_count_and_each_once(tmp_path: Path) -> None:
    at = teach(tmp_path, angle=radians(2.0))
    service = start(tmp_path)
    client = Client(service.url, service.token_file)
    before = client.object(DOOR, at, samples=True)
    report = partial(client.report, DOOR, "sensor", "open", reliability=0.6, at=at)
    with ThreadPoolExecutor(8) as pool:
        sent = [pool.submit(report, identity=f"report {k}") for k in (*range(8), 3, 3)]
    after = client.object(DOOR, at, samples=True)
    service.kill()
    assert all(each.result().stamp_ns == at for each in sent)
    assert before.states is not None
    assert before.weights is not None
    pairs = zip(before.states, before.weights, strict=True)
    likely = [w * (0.6 if angle >= radians(2.0) else 0.4) ** 8 for (angle,), w in pairs]
    assert after.weights == pytest.approx([w / sum(likely) for w in likely], abs=1e-5)
