"""The studies: each a package with `sweep.toml`, `study.py` and `analysis.py`."""
