"""From a recording and settings to the best arm: the only room that knows the swarm and the robot."""
