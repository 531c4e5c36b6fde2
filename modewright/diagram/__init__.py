"""Diagrams of modes: boxes, layout, SVG and Mermaid."""
