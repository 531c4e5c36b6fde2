"""Commands: one file each; heavy imports stand inside the functions so that --help is quick."""
