"""What the records of a scene are made of: names, references to points, functions of time."""
