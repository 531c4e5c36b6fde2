"""The running process: threads, garbage collection, output files, diagnosis of the installation."""
