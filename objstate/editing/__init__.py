"""Looking at a building's doors over the scans of drives, and putting them right, in a browser."""

from objstate.editing.app import edit_app, serve
from objstate.editing.page import edit_page
from objstate.editing.saving import save
from objstate.editing.subject import Subject, subject_of

__all__ = ["Subject", "edit_app", "edit_page", "save", "serve", "subject_of"]
