"""ghest-rt: glenohumeral joint angles inside a rehabilitation exoskeleton, in real time."""

__version__ = "0.1.0"
