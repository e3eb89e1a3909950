"""Connections to robots that don't send by themselves: kept up, and taken up again when they break."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Mapping

from objstate.errors import ObjstateError
from objstate.logs import Message
from objstate.service.live.foxglove import foxglove_messages
from objstate.service.live.options import Protocol, RobotAddress
from objstate.service.live.robots import Robots
from objstate.service.live.rosbridge import rosbridge_messages
from objstate.service.problems import Problem

FIRST_WAIT_S, LONGEST_WAIT_S = 0.5, 10.0  # before a connection is tried again

SOURCES: Mapping[Protocol, Callable[[str], AsyncIterator[list[Message]]]] = {
    "foxglove": foxglove_messages,
    "rosbridge": rosbridge_messages,
}

logger = logging.getLogger(__name__)


class Link:
    """The connection to one robot."""

    def __init__(self, where: RobotAddress, robots: Robots) -> None:
        self.where, self._robots = where, robots
        self.state = "connecting"

    async def run(self) -> None:
        """Pass on what the robot sends, until cancelled."""
        from websockets.exceptions import WebSocketException

        wait_s = FIRST_WAIT_S
        while True:
            reason = "it was closed"
            try:
                async for messages in SOURCES[self.where.protocol](self.where.address):
                    if self.state != "connected":
                        logger.info("%s is connected", self.where.robot)
                        self.state, wait_s = "connected", FIRST_WAIT_S
                    await asyncio.to_thread(self._robots.take, self.where.robot, messages)
            except (OSError, WebSocketException, ValueError, ObjstateError, Problem) as error:
                reason = str(error) or type(error).__name__
            self.state = f"not connected: {reason}"
            logger.warning("%s at %s: %s", self.where.robot, self.where.address, reason)
            await asyncio.sleep(wait_s)
            wait_s = min(2.0 * wait_s, LONGEST_WAIT_S)
