"""What people look at: the preview and the report."""
