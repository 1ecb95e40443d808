"""DH tables, Pinocchio models from them, the arm skeleton and damped least squares."""
