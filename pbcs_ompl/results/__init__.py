"""Result folders: files, locks, provenance, and the report."""
