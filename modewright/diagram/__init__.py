"""Diagrams of modes: read boxes and arrows from a spec, compute a layout, draw SVG or Mermaid."""
