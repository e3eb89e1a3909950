"""Editing a building's doors in a browser, over the scans of drives."""

from objstate.editing.app import edit_app, serve
from objstate.editing.page import edit_page
from objstate.editing.saving import save
from objstate.editing.subject import Subject, subject_of

__all__ = ["Subject", "edit_app", "edit_page", "save", "serve", "subject_of"]
