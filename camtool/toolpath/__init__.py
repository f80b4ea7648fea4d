"""The records that planning, posts and simulation share."""
