"""Drivers for real devices. A vendor library is imported only when its backend is chosen."""
