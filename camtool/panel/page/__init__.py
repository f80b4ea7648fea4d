"""The files of the panel's page."""
