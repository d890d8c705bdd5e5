"""The fused way: one error-state filter over both markers and the encoders; derivation in docs/fused-estimator.md."""
