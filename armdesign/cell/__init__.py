"""What stands in the room: places for the base, obstacles, and the volume that the demonstrator has swept."""
