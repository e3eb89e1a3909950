"""Settings whose objects have other constants."""

from __future__ import annotations

from typing import Literal

from objstate.config import ObjectSettings, Settings


class Altered(Settings):
    """Settings of which every object's are changed."""

    changes: dict[str, int | float]

    def for_object(self, name: str, default_class: Literal["door", "furniture"]) -> ObjectSettings:
        chosen = super().for_object(name, default_class)
        known = {key: value for key, value in self.changes.items() if hasattr(chosen, key)}
        return chosen.model_copy(update=known)
