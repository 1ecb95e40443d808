"""The studio: one local page from the take to the arm, which calls the rooms below and says how to do it again."""
