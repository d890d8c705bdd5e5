"""`ghest-rt install-service`: plan, steps and record of an installation under systemd."""
