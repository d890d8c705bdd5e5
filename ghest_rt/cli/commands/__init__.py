"""The commands by topic: their options and help. Each imports what it needs when it runs, so that `--help` is quick."""
