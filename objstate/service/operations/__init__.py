"""The operations of the service, a module a subject: routes and the OpenAPI document follow from them."""

from objstate.service.operations import drives, objects, planning, robots, streaming, uploads
from objstate.service.operations.operation import Operation, Query

OPERATIONS = (
    *drives.OPERATIONS,
    *uploads.OPERATIONS,
    *robots.OPERATIONS,
    *objects.OPERATIONS,
    *planning.OPERATIONS,
    *streaming.OPERATIONS,
)

__all__ = ["OPERATIONS", "Operation", "Query"]
