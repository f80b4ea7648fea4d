"""What controllers share: the motion that a machine makes of a toolpath."""
