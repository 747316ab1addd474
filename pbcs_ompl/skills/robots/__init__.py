"""Followers of robots: one policy trained once on random lines, which then follows any line."""
