"""What holds one way only, resolved: stops of joints, ropes that may slacken, friction in joints."""
