"""What was planned and trained, in the formats of other tools; each format is one file of this package."""
