"""Calibration of a machine by coupons: drawings, measurements, and the resulting numbers."""
