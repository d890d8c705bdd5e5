"""Method `photometric`: the edges of the disks, pixel by pixel, aligned with a model of the marker (docs/photometric.md)."""
