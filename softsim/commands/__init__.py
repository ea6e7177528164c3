"""What the commands print: one file a command that says more than a line or two."""
