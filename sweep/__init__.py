"""sweep: studies of many variants of a system - what varies, what is measured, the store."""
