"""Parts for etb_hil: one of each kind, one file each."""
