"""Pictures of trees, skill chains, critics and comparisons, written without a display."""

from pbcs_ompl.core.matplotlib_import import import_matplotlib

import_matplotlib()
