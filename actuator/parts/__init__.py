"""What an actuator is made of: motors, inverter, link, heat, sensors, loads."""
