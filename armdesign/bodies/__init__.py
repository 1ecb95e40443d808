"""What an arm is made of: tubes, joint modules, base and tool, their shapes and masses."""
