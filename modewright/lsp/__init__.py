"""Language server: what an editor asks about specs while they are written."""
