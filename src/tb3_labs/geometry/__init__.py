"""What do the numbers mean? Angles, quaternions, poses in the plane. This room does not know robots."""
