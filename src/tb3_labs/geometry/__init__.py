"""What do the numbers mean? This folder computes with angles, quaternions, poses in the plane and
sorted times. It does not know robots."""
