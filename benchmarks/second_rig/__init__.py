"""Second rig: specimens of dampers with hidden effects, made without any code of the first rig or of mrfit."""
