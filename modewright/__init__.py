"""The face of the product: command line and public API."""
