"""The virtual throttle controller: answers on CAN in place of hardware."""
