"""What do the numbers mean? Angles, quaternions, poses in the plane; not yet robots."""
