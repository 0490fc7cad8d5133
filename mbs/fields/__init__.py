"""Fields of the records of a scene: names, references to points, functions of time."""
