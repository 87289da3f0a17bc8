"""From a raw table to a trace: units, time stamps, repairs, the uniform grid."""
