"""Recordings: MCAP files with images, encoder samples, the station file and, from a simulation, the truth."""
