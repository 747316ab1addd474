"""`python -m pbcs_ompl.cli`, where the `pbcs` script is not on the PATH."""

from pbcs_ompl.cli import main

raise SystemExit(main())
