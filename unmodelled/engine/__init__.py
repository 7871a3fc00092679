"""Free runs of a system: functions, compiled rollouts and a register machine made from its equations."""
