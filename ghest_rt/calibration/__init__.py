"""Calibration of a station to its patient from a recorded session: centres, attitudes, and what the session cannot tell."""
