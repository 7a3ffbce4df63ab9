"""Places of parameters, effects and logged columns in the arrays that the compiled plant works on."""

# Parameters of the unit, SI, at the throttle shaft unless the name says motor.
PARAMETERS = (
    "resistance",
    "inductance",
    "motor_constant",  # K = K_e = K_t at the motor shaft
    "gear_ratio",
    "motor_inertia",  # at the motor shaft
    "plate_inertia",
    "preload_open",
    "preload_close",
    "slope_open",
    "slope_close",
    "limp_home",
    "dead_zone",  # half width
    "stop_low",
    "stop_high",
    "stop_stiffness",
    "stop_damping",
    "coulomb",
    "stiction",
    "stribeck_velocity",
    "bristle_stiffness",
    "bristle_damping",
    "viscous",
)
(
    R,
    L,
    K,
    N,
    J_MOTOR,
    J_PLATE,
    PRELOAD_OPEN,
    PRELOAD_CLOSE,
    SLOPE_OPEN,
    SLOPE_CLOSE,
    LIMP_HOME,
    DEAD_ZONE,
    STOP_LOW,
    STOP_HIGH,
    STOP_STIFFNESS,
    STOP_DAMPING,
    COULOMB,
    STICTION,
    STRIBECK,
    SIGMA0,
    SIGMA1,
    VISCOUS,
) = range(len(PARAMETERS))

CATALOGUE = (
    "friction_position_periodic",
    "friction_position_local",
    "friction_temperature",
    "friction_asymmetry",
    "friction_load",
    "stiction_dwell",
    "stribeck_shape",
    "presliding_hysteresis",
    "gear_backlash",
    "shaft_compliance",
    "cogging_torque",
    "torque_ripple",
    "spring_nonlinear",
    "spring_preload_shift",
    "limp_home_dead_zone",
    "aerodynamic_torque",
    "end_stop_compliance",
    "iron_loss",
    "resistance_temperature",
    "magnet_temperature",
    "brush_drop",
    "hbridge_dead_time",
    "supply_sag",
    "current_sensor_gain",
    "current_sensor_offset",
    "angle_sensor_eccentricity",
    "sensor_hysteresis",
    "measurement_delay",
)
OUTSIDE = (
    "air_drag",
    "running_in",
    "friction_bursts",
    "eccentric_inertia",
    "external_vibration",
    "supply_ripple",
    "encoder_slip",
    "magnetic_saturation",
    "brush_contact_position",
    "spring_thermal_drift",
    "current_sensor_curvature",
    "plate_sensor_curvature",
)
# Of the tool's catalogue too, hidden by name alone: pairs that are drawn from a seed stay what they were.
LATE_ANGLES = ("angle_delay", "motor_angle_delay", "plate_angle_delay")
EFFECTS = CATALOGUE + OUTSIDE + LATE_ANGLES
ROW = {name: row for row, name in enumerate(EFFECTS)}
(
    FRICTION_PERIODIC,
    FRICTION_LOCAL,
    FRICTION_TEMPERATURE,
    FRICTION_ASYMMETRY,
    FRICTION_LOAD,
    DWELL,
    STRIBECK_SHAPE,
    PRESLIDING,
    BACKLASH,
    COMPLIANCE,
    COGGING,
    RIPPLE,
    SPRING_SHAPE,
    PRELOAD_SHIFT,
    LIMP_HOME_ZONE,
    AERODYNAMIC,
    SOFT_STOP,
    IRON_LOSS,
    COPPER_HEAT,
    MAGNET_HEAT,
    BRUSH_DROP,
    DEAD_TIME,
    SAG,
    CURRENT_GAIN,
    CURRENT_OFFSET,
    ECCENTRICITY,
    PLATE_HYSTERESIS,
    DELAY,
    AIR_DRAG,
    RUNNING_IN,
    BURSTS,
    ECCENTRIC_INERTIA,
    VIBRATION,
    SUPPLY_RIPPLE,
    SLIP,
    SATURATION,
    BRUSH_CONTACT,
    SPRING_HEAT,
    CURRENT_CURVATURE,
    PLATE_CURVATURE,
    ANGLE_DELAY,
    MOTOR_DELAY,
    PLATE_DELAY,
) = range(len(EFFECTS))

# Each effect's row: its strength, the variant of its shape, then shape parameters of its own.
STRENGTH, FORM, A, B, C, D = range(6)
ROW_WIDTH = 6

# Columns that change with time and are given to the plant at every control tick.
(
    IN_ANGLE,  # reference, rad
    IN_VELOCITY,  # reference, rad/s
    IN_VOLTAGE,  # added to the controller's voltage, or the whole voltage in open loop
    IN_MODE,
    IN_TEMPERATURE,  # housing, degC
    IN_RUNNING_IN,  # the next three: unit size, times the effect's strength
    IN_BURSTS,
    IN_VIBRATION,
) = range(8)
INPUTS = 8
CLOSED_LOOP, OPEN_LOOP, BRIDGE_OFF = 0.0, 1.0, 2.0

# Columns of the true record.
LOG_ANGLE, LOG_VELOCITY, LOG_CURRENT, LOG_PLATE, LOG_PLATE_VELOCITY, LOG_CURRENT_RATE = range(6)
LOG_COMMAND, LOG_TERMINAL, LOG_BRISTLE, LOG_FRICTION, LOG_SUPPLY, LOG_ACCELERATION, LOG_WINDING, LOG_MODE = range(6, 14)
LOGGED = 14

# Slow states, moved once a step: contact age, reversal memory, winding and magnet temperature.
AGE, MEMORY, WINDING, MAGNET = range(4)
