"""The continuous mazes of [Matheron2020] 4.1, 5.4 and 7.3."""
