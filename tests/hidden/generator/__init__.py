"""An independent throttle bench: units, effects, sensors and sealed truths for tests that hide an effect in data.

It shares no code with the package under test, so that both can only agree where the physics agrees.
"""
