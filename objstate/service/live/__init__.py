"""Robots that send while they drive: journals, estimation as it goes on, and the ways in."""
