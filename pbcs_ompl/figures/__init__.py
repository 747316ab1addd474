"""Pictures of trees, skill chains, critics and comparisons, written without a display."""
