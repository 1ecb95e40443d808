"""Recordings as files: recognised by content, read into memory, written."""
