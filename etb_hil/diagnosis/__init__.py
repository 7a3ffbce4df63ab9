"""From friction torque to T_st, T_c, exceedances and a verdict."""
