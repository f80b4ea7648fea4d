"""Pockets: rings or a zigzag, linked, entered, with what stays uncut told."""
