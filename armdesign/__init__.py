"""armdesign: turn a recorded human-arm demonstration into the robot arm that does the job."""

__version__ = "0.1.0"
