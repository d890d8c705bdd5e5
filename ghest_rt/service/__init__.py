"""The live service: devices and vision off the event loop, an absolute tick, messages out."""
