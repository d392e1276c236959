"""The simulator against reality: towers, observed ranges, the weather generator, disturbance."""
