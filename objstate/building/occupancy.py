"""ROS occupancy maps: a picture of the floor plan and a YAML file that says where it lies.

Source: the map_server and nav2_map_server documentation of the map format.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from objstate.config import Angle
from objstate.errors import BuildingError
from objstate.faults import faults
from objstate.geometry import BoolArray, FloatArray, between, compose
from objstate.kinds import IMAGE, MAP, instead, kind_of
from objstate.yaml_files import YamlError, read_yaml

ENDINGS = (".yaml", ".yml")  # of a map's file
RAW_FULL = 100  # value of a certainly occupied cell in mode raw; larger ones are unknown
OPAQUE = 1.0
OCCUPIED_THRESH = 0.65  # map_saver's
UNKNOWN = 0.19  # map_saver draws what is unknown as 205 of 255, whatever its free_thresh
SAMPLE = "image, resolution, origin, negate, occupied_thresh and free_thresh, as map_saver writes"

Share = Annotated[float, Field(ge=0, le=1)]
Number = Annotated[float, Field(ge=-1e8, le=1e8)]  # m; also coordinates of a country


class MapFile(BaseModel):
    """The YAML file of a map. Keys that map servers add are let pass."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    image: str
    resolution: Annotated[float, Field(ge=1e-4, le=10)]  # m per cell
    origin: tuple[Number, Number, Angle]  # x m, y m, yaw rad of the lower left corner
    negate: bool = False
    occupied_thresh: Share = OCCUPIED_THRESH
    free_thresh: Share = 0.25
    mode: Literal["trinary", "scale", "raw"] = "trinary"


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """Which cells of the floor are occupied. Cell [row, column] counts from the lower left."""

    occupied: BoolArray = field(repr=False)  # (rows, columns)
    free: BoolArray = field(repr=False)  # (rows, columns); others are unknown
    resolution: float  # m
    origin: FloatArray  # (3,) pose of the lower left corner in the building
    name: str = "map"  # of what is made of it

    @staticmethod
    def of_percent(
        percent: NDArray[np.int8], resolution: float, origin: FloatArray, name: str
    ) -> OccupancyMap:
        """The map of a ROS message: percent (rows, columns) from the lower left, -1 unknown.

        Raises BuildingError where no cell is occupied.
        """
        occupied = percent >= RAW_FULL * OCCUPIED_THRESH  # as map_saver draws it black
        if not occupied.any():
            raise BuildingError(f"The map of {name} has no occupied cell; give another.")
        free = (percent >= 0) & (percent <= RAW_FULL * UNKNOWN)
        return OccupancyMap(occupied, free, resolution, origin, name)

    def without(self, points: FloatArray) -> OccupancyMap:
        """The map with free cells at points (n, 2) m of the building."""
        column, row = np.floor(self.to_cells(points)).astype(np.int64).T
        occupied, free = self.occupied.copy(), self.free.copy()
        occupied[row, column], free[row, column] = False, True
        return replace(self, occupied=occupied, free=free)

    @property
    def middles(self) -> FloatArray:
        """(k, 2) m of the building, of the occupied cells, row after row."""
        rows, columns = np.nonzero(self.occupied)
        cells: FloatArray = np.column_stack([columns, rows]) + np.float64(0.5)
        return self.to_building(cells)

    def moved(self, shift: FloatArray) -> OccupancyMap:
        """The map elsewhere in the building, by (2,) m."""
        return replace(self, origin=self.origin + np.append(shift, 0.0))

    def to_cells(self, points: FloatArray) -> FloatArray:
        """Points (n, 2) in cells (column, row) from points (n, 2) m in the building."""
        poses = np.column_stack([points, np.zeros(len(points))])
        return np.asarray(between(self.origin, poses)[:, :2] / self.resolution)

    def to_building(self, cells: FloatArray) -> FloatArray:
        """Points (n, 2) m in the building from points (n, 2) in cells: column, row."""
        flat = np.column_stack([cells * self.resolution, np.zeros(len(cells))])
        return compose(self.origin, flat)[:, :2]


def is_map(path: Path) -> bool:
    """Whether a file is a ROS map, by its name, and not a URDF."""
    return path.suffix.lower() in ENDINGS


def files_of_map(path: Path) -> tuple[Path, Path]:
    """A map's file, and the image that it names. Raises BuildingError if it can't be used."""
    return path, path.parent / _read_header(path).image


def read_map(path: Path) -> OccupancyMap:
    """A ROS occupancy map. Raises BuildingError if the YAML or the image can't be used."""
    header = _read_header(path)
    occupancy, known = _occupancy(_read_image(path, header), header)
    occupied = known & (occupancy > header.occupied_thresh)
    if not occupied.any():
        raise BuildingError(
            f"The map {path} has no occupied cell; check 'negate' ({header.negate}), 'mode' "
            f"({header.mode}) and 'occupied_thresh' ({header.occupied_thresh:g})."
        )
    free = known & (occupancy < min(header.free_thresh, UNKNOWN))
    return OccupancyMap(
        occupied[::-1], free[::-1], header.resolution, np.array(header.origin), path.stem
    )


def read_probabilities(path: Path) -> tuple[NDArray[np.float32], float, FloatArray]:
    """A ROS occupancy map: P(occupied) (rows, columns), a cell's side in m, and origin (3,).

    Rows count from the lower left corner, which lies at the origin. Cells that are not opaque, or
    unknown in mode raw, have 0.5. Raises BuildingError if the YAML or the image can't be used.
    """
    header = _read_header(path)
    image = _read_image(path, header)
    white, known = image[..., 0], image[..., 1] == OPAQUE
    shares = white if header.negate else 1.0 - white
    if header.mode == "raw":
        shares = np.round(white * np.iinfo(np.uint8).max) / RAW_FULL
        known &= shares <= 1.0
    values = np.where(known, shares, 0.5).astype(np.float32)
    return np.ascontiguousarray(values[::-1]), header.resolution, np.array(header.origin)


def _not_a_map(path: Path) -> str | None:
    """What was given instead, if that is known."""
    if kind_of(path) == IMAGE:
        return f"{path} is a map's image; give the .yaml file that lies beside it."
    return instead(path, MAP)


def _read_header(path: Path) -> MapFile:
    try:
        content = read_yaml(path)
    except OSError as error:
        raise BuildingError(
            f"The map {path} can't be read ({error.strerror}); check the path."
        ) from error
    except YamlError as error:
        raise BuildingError(
            _not_a_map(path)
            or f"The map {path} is not valid YAML ({error}); give the .yaml file that lies beside "
            "the map's image."
        ) from error
    try:
        return MapFile.model_validate(content)
    except ValidationError as error:
        told = _not_a_map(path)
        if told is None:
            found = "; ".join(faults(MapFile, error, content))
            told = f"The map {path} can't be used: {found}; it needs {SAMPLE}."
        raise BuildingError(told) from error


def _read_image(path: Path, header: MapFile) -> FloatArray:
    """(rows, columns, 2) the share of white and the opacity of each pixel, top row first."""
    from PIL import Image

    image_path = path.parent / header.image
    try:
        with Image.open(image_path) as opened:
            image = opened.convert("RGBA" if opened.mode in ("P", "1") else opened.mode)
            pixels = np.asarray(image, dtype=float)
    except FileNotFoundError as error:
        raise BuildingError(
            f"The map {path} names the image '{header.image}', but {image_path} does not exist; "
            "correct 'image' or put the file there."
        ) from error
    except Exception as error:  # whatever a damaged file raises in its reader
        raise BuildingError(
            f"The image {image_path} of the map {path} can't be read ({error}); "
            "save it again as PGM or PNG."
        ) from error
    pixels /= np.iinfo(np.uint16).max if image.mode.startswith("I") else np.iinfo(np.uint8).max
    if pixels.ndim == 2:
        return np.stack([pixels, np.full_like(pixels, OPAQUE)], axis=-1)
    has_alpha = image.mode in ("LA", "RGBA")
    white = pixels[..., :-1] if has_alpha else pixels
    alpha = pixels[..., -1] if has_alpha else np.full(pixels.shape[:2], OPAQUE)
    return np.stack([white.mean(axis=-1), alpha], axis=-1)


def _occupancy(image: FloatArray, header: MapFile) -> tuple[FloatArray, BoolArray]:
    """(rows, columns) how occupied each cell is, 0 to 1, and whether that is known."""
    white, alpha = image[..., 0], image[..., 1]
    if header.mode == "raw":
        percent = np.round(white * np.iinfo(np.uint8).max)
        return percent / RAW_FULL, percent <= RAW_FULL
    occupancy = white if header.negate else 1.0 - white
    is_scale = header.mode == "scale"
    return occupancy, alpha == OPAQUE if is_scale else np.ones(alpha.shape, dtype=bool)
