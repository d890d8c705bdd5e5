"""What the cameras see of a simulated session: rendered and looked at once, whatever is estimated from it later."""
