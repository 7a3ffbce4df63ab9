"""Everything that touches CAN frames: buses, DBC files, protection, logs."""
