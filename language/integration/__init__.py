"""Integration methods as operations of a Program, and the location of crossings."""
