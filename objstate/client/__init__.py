"""Asking a running service (``objstate serve``) from Python, and sending it drives.

``Client`` blocks, ``AsyncClient`` awaits; both have the same methods and raise the same errors.
"""

from objstate.client.answers import (
    Believed,
    Blockage,
    Blocker,
    DoorModes,
    Drive,
    Edges,
    Event,
    History,
    Interval,
    Objects,
    Passage,
    Robot,
)
from objstate.client.asynchronous import AsyncClient
from objstate.client.blocking import Client

__all__ = [
    "AsyncClient",
    "Believed",
    "Blockage",
    "Blocker",
    "Client",
    "DoorModes",
    "Drive",
    "Edges",
    "Event",
    "History",
    "Interval",
    "Objects",
    "Passage",
    "Robot",
]
