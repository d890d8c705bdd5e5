"""Driver layer of ghest-rt: RGB-D cameras and encoder links behind small interfaces, with real, replay and sim backends.

This package knows nothing of the application (`ghest_rt`); the application hands it what it needs.
"""
