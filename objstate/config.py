"""Settings: every constant of the estimator, with a default that serves without a file.

Parameters that Nav2's AMCL has carry its names and meanings. Files are checked
strictly where they come in; an unknown key is an error that names the nearest
known one.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


class Strict(BaseModel):
    """A group of settings: unknown keys are refused, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)
