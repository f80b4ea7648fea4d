"""Boards: Gerber and Excellon files, alone or in a ZIP archive."""
