"""The command line `ghest-rt`."""
