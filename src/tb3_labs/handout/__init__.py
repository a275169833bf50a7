"""What is a class given? Skeletons of the labs' nodes, and the package's students' edition."""
