"""Fewer reversals while cutting: contours divided into runs, approached in the air."""
