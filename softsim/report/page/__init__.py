"""Report pages: single HTML files that need neither a network nor other files."""
