"""Who may talk to a station, what may be read, and what is kept secret: identities, access, sealed recordings."""
