"""Independent high-precision reference for flights, contacts, impacts and runs; see README.md."""
