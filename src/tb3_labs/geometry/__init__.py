"""What do the numbers mean? Angles, quaternions, and poses in the plane. This room does not know
robots."""
