"""Simulation shared by all controllers: the motion that a machine makes of a toolpath."""
