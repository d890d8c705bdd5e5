"""A simulated session in memory: from the clinic through the detectors and the estimator to errors, without a recording."""
