"""Cached properties, modules that are imported on first use, and fast copies of values."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")
D = TypeVar("D", bound="DataclassInstance")


class lazy(Generic[T]):  # noqa: N801 - a decorator
    """``functools.cached_property`` without the lock that Python takes there up to 3.11.

    Two threads that ask at once may both compute, and get equal values.
    """

    def __init__(self, compute: Callable[[Any], T]) -> None:
        self._compute = compute
        self.__doc__ = compute.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> lazy[T]: ...

    @overload
    def __get__(self, instance: object, owner: type) -> T: ...

    def __get__(self, instance: object | None, owner: type) -> lazy[T] | T:
        if instance is None:
            return self
        value = instance.__dict__[self._name] = self._compute(instance)
        return value


class Later:
    """A module that is imported on first use, such as compiled loops, which need numba.

    An import within a function does so too, but looks the module up at each call. Let type checkers
    import it in the usual way (``TYPE_CHECKING``).
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        value = self.__dict__[name] = getattr(import_module(self._name), name)
        return value


def altered(value: D, **fields: Any) -> D:
    """``dataclasses.replace`` for values that need no checks, at a fraction of its cost.

    Cached properties are dropped.
    """
    other: D = object.__new__(type(value))
    known, to = value.__dict__, other.__dict__
    for name in value.__dataclass_fields__:
        to[name] = known[name]
    to.update(fields)
    return other
