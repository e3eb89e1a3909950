"""Figures for Prometheus, in its text format."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping

BUCKETS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5, 2.0)  # s


class Metrics:
    """Requests by route and status, and how long they took."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._requests: Counter[tuple[str, str, int]] = Counter()
        self._within: Counter[float] = Counter()
        self._seconds, self._count = 0.0, 0

    def note(self, method: str, route: str, status: int, seconds: float) -> None:
        """A request was answered."""
        with self._lock:
            self._requests[method, route, status] += 1
            self._seconds, self._count = self._seconds + seconds, self._count + 1
            for bound in BUCKETS:
                self._within[bound] += seconds <= bound

    def text(self, gauges: Mapping[str, float]) -> str:
        """All figures; ``gauges`` are what is so now."""
        with self._lock:
            lines = ["# TYPE objstate_requests_total counter"]
            for (method, route, status), count in sorted(self._requests.items()):
                labels = f'method="{method}",route="{route}",status="{status}"'
                lines.append(f"objstate_requests_total{{{labels}}} {count}")
            lines.append("# TYPE objstate_request_seconds histogram")
            name = "objstate_request_seconds"
            lines += [f'{name}_bucket{{le="{each}"}} {self._within[each]}' for each in BUCKETS]
            lines += [f'{name}_bucket{{le="+Inf"}} {self._count}']
            lines += [f"{name}_sum {self._seconds:.6f}", f"{name}_count {self._count}"]
        for gauge, value in gauges.items():
            lines += [f"# TYPE objstate_{gauge} gauge", f"objstate_{gauge} {value:g}"]
        return "\n".join(lines) + "\n"
