"""The station file: which sensors, which calibration, which estimator, where to publish."""
