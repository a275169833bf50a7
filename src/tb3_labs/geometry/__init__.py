"""What do the numbers mean? Angles, quaternions, poses in the plane, and sorted times. This room
does not know robots."""
