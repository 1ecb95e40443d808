"""The compiled part of the report's pictures."""
