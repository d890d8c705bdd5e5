"""What all camera drivers share: pairing, queueing, numbering, distortion models. No vendor library is imported here."""
