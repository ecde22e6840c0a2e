"""An independent simulator in ball arithmetic, for checks of the compiled core.

Flights, first contacts, impacts, chatter and contact at any precision (theory page, sections 1
to 5; `structure`, for linear structures with stops: structures page), computed by other formulas
than those of the core: no module here uses any other part of vibroimpact. `vibroimpact.verify`
re-runs a result with it; tests/reference makes the reference data with it, and its README.md says
what is proved and what is estimated. It needs python-flint: pip install python-flint.
"""
