"""What do the numbers mean? Angles, quaternions, poses in the plane. Knows nothing of robots."""
