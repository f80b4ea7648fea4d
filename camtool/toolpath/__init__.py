"""The records that planning, targets and simulation share."""
