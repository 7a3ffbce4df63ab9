"""The throttle as equations: motor, gear, LuGre friction, two springs, stops."""
