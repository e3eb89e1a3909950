"""Figures for Prometheus."""

from __future__ import annotations

from collections.abc import Mapping

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST

MEDIA = CONTENT_TYPE_LATEST
ANSWERED_S = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5, 2.0)
DELAYED_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)
ESTIMATED_S = (1.0, 5.0, 20.0, 60.0, 300.0, 1200.0, 3600.0)


class Metrics:
    """What one service counts."""

    def __init__(self) -> None:
        self._registry = r = CollectorRegistry()
        routes = ("method", "route")
        self._requests = Counter(
            "objstate_requests", "Requests answered", (*routes, "status"), registry=r
        )
        self._seconds = Histogram(
            "objstate_request_seconds",
            "From a request to its answer",
            routes,
            registry=r,
            buckets=ANSWERED_S,
        )
        self._ended = Counter("objstate_drives_ended", "Drives estimated", ("state",), registry=r)
        self._estimating = Histogram(
            "objstate_drive_seconds", "To estimate a drive", registry=r, buckets=ESTIMATED_S
        )
        self._scans = Counter("objstate_scans", "Scans of the drives estimated", registry=r)
        self._lost = Counter(
            "objstate_lost_drives", "Drives in which the robot was lost for a while", registry=r
        )
        self._delays = Histogram(
            "objstate_belief_delay_seconds",
            "From a live scan's coming in to its beliefs on the stream",
            registry=r,
            buckets=DELAYED_S,
        )
        self._gauges: dict[str, Gauge] = {}

    def note(self, method: str, route: str, status: int, seconds: float) -> None:
        """A request was answered."""
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)

    def note_drive(self, state: str, seconds: float, scans: int, lost_share: float) -> None:
        """A drive has ended."""
        self._ended.labels(state).inc()
        self._estimating.observe(seconds)
        self._scans.inc(scans)
        if lost_share > 0.0:
            self._lost.inc()

    def note_delay(self, seconds: float) -> None:
        """A live scan's beliefs were published."""
        self._delays.observe(seconds)

    def text(self, gauges: Mapping[str, float]) -> bytes:
        """All figures; ``gauges`` are what is so now, by name."""
        for name, value in gauges.items():
            if name not in self._gauges:
                told = name.replace("_", " ").capitalize()
                self._gauges[name] = Gauge(f"objstate_{name}", told, registry=self._registry)
            self._gauges[name].set(value)
        return generate_latest(self._registry)
