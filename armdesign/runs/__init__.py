"""Run folders: what is in them, writing, reading, and searches that survive being killed."""
