"""Bringing streams with their own clocks and rates to one instant: bounded histories, interpolation, the output grid."""
