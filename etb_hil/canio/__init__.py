"""Everything that touches CAN frames: buses, DBC files, roles, protection, logs, health."""
