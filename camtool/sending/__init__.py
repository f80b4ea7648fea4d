"""Programs to their machines by the machine's own protocol, and virtual machines to try it on.

Nothing here knows a machine: its target brings both ends of the wire (`camtool.target.twin` is the
contract of the virtual one), and these two share no code.
"""
