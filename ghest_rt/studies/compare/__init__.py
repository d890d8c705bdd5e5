"""The comparison with other ways of learning the GH angles: Table 7 made real."""
