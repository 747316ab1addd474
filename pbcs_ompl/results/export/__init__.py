"""What was planned and trained, in the formats of other tools; each format is one file of this package."""

from pbcs_ompl.results.export.formats import FORMATS, Export, export

__all__ = ["FORMATS", "Export", "export"]
