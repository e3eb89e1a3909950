"""The data folder of a service belongs to one world, and the world's drives lie in one folder."""

from __future__ import annotations

import uuid
from pathlib import Path

from sqlalchemy import Connection, delete, insert, select, update

from objstate.errors import SettingsError
from objstate.outputs import make_folder, write_text
from objstate.service.tables import DRIVES, FOLDER
from objstate.world.database import Database

IDENTITY = "folder-id"  # a file in the folder: its identity, and the world


def claim(database: Database, folder: Path, *, is_new: bool = False) -> None:
    """Take a folder for a world's drives at the first start; later, see that it is that one.

    With ``is_new`` it takes the place of one that is lost. Raises SettingsError, WorldError.
    """
    make_folder(folder)
    path, world = folder / IDENTITY, str(database.location)
    own, of_world = path.read_text(encoding="utf-8").splitlines() if path.exists() else (None, None)
    with database.writing() as connection:
        known = connection.execute(select(FOLDER.c.identity, FOLDER.c.path)).first()
        if known is not None and known.identity == own:
            connection.execute(update(FOLDER).values(path=str(folder.absolute())))
            return
        if own is not None and of_world != world:
            raise SettingsError(
                f"{folder} has the drives of the world {of_world}; give another --data."
            )
        if known is None:
            is_other = not (folder / "logs").is_dir() and _has_drives(connection)
        else:
            is_other = own is not None or _has_drives(connection)
        if is_other and not is_new:
            where = "another folder" if known is None else known.path
            raise SettingsError(
                f"The world's drives lie in {where}, not in {folder}; give that as --data. If it is "
                "lost, give --new-data."
            )
        own = own or uuid.uuid4().hex
        write_text(path, f"{own}\n{world}\n")
        connection.execute(delete(FOLDER))
        connection.execute(insert(FOLDER).values(identity=own, path=str(folder.absolute())))


def _has_drives(connection: Connection) -> bool:
    """Whether a world's services have taken any."""
    return connection.execute(select(DRIVES.c.id)).first() is not None
