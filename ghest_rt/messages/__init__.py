"""What passes between the rooms (frozen dataclasses) and what leaves the process (pydantic)."""
