"""What is a class given? Skeletons of the labs' nodes, and the students' edition of this package."""
