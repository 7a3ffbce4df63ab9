"""The temperature to which values are referred."""

# degC. Models state their values at it, and windings (IEC 60034-1) and friction are referred to it.
REFERENCE_TEMPERATURE = 20.0
